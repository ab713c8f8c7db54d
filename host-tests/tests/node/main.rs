//! The node, and the objects of all its personalities, in this process: no emulated board, no clock. One program, for the time that
//! each program takes to link.

mod bit_timing;
mod calibration;
mod cia404_chain;
mod cia404_edges;
mod cia406_chain;
mod combined_node;
mod emergencies;
mod encoder_node;
mod full_bus;
mod lift_calls;
mod lift_catalogue;
mod lift_node;
mod lift_pdos;
mod long_run;
mod lossy_bus;
mod memory_map;
mod module_cycles;
mod object_tables;
mod personalities;
mod pressure_node;
mod program_trial;
mod stuck_client;
mod unsafe_code;
