#![no_main]

splatkit_fuzz::target!(splv_summed);
