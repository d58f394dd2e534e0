//! Files of other programs, written and read by the program.

mod exchange_command;
mod export_pictures;
mod short_storage;
