#![no_main]

splatkit_fuzz::target!(vtk);
