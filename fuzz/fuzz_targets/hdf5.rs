#![no_main]

splatkit_fuzz::target!(hdf5);
