//! The program as people and scripts meet it: command line, messages, reports, limits; documents and the
//! structure of the sources.

#[path = "../support/mod.rs"]
mod support;

mod architecture;
mod bad_input;
mod checkpoint;
mod cluster;
mod command_line;
mod comparison_coverage;
mod docs_generated;
mod ends;
mod front_door;
mod hostile_files;
#[cfg(unix)]
mod how_to;
mod interruption;
mod json_output;
mod kept_in_files;
mod licences;
mod limits;
mod odd_files;
mod replaced_inputs;
mod report;
mod report_comparison;
mod view;
