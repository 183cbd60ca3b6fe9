#![no_main]

splatkit_fuzz::target!(e57);
