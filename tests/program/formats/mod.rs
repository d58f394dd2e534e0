//! Files of other programs, as the program writes and reads them.

mod exchange_command;
mod export_pictures;
mod short_storage;
