#![no_main]

splatkit_fuzz::target!(splk_summed);
