#![no_main]

splatkit_fuzz::target!(sog_streamed);
