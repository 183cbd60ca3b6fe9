#![no_main]

splatkit_fuzz::target!(ksplat);
