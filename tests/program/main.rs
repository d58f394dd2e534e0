//! Tests of the program: command line, messages, reports, limits, documents and the structure of the sources.

#![allow(unreachable_pub)] // tests export nothing

mod answers;
mod bad_input;
mod bodies;
mod ci_example;
mod circles;
mod cluster;
mod command_line;
mod docs_generated;
mod ends;
mod faults;
mod formats;
mod front_door;
mod hostile_files;
mod interruption;
mod jointed;
mod json_output;
mod kept_in_files;
mod language;
mod library_parity;
mod licences;
mod limits;
mod models;
mod motion;
mod odd_files;
mod operators;
mod pages;
mod program;
mod python_stub;
mod replaced_inputs;
mod stress_colours;
mod structure;
mod study;
mod view;
