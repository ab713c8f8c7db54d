//! Tests of the node and of the objects of all its personalities, in this process: without an emulated board and
//! without a clock. All tests are in one program, to save the link time of several programs.

mod bit_timing;
mod board_calls;
mod calibration;
mod cia404_chain;
mod cia404_edges;
mod cia406_chain;
mod cob_ids;
mod combined_node;
mod emergencies;
mod encoder_node;
mod error_behaviour;
mod full_bus;
mod lift_calls;
mod lift_catalogue;
mod lift_choice;
mod lift_node;
mod lift_pdos;
mod long_run;
mod lossy_bus;
mod memory_map;
mod module_cycles;
mod object_tables;
mod older_samples;
mod personalities;
mod pressure_node;
mod program_gate;
mod program_trial;
mod resets;
mod self_test;
mod storing;
mod stuck_client;
mod thresholds;
mod unsafe_code;
mod ways;
