#![no_main]

splatkit_fuzz::target!(convert_render);
