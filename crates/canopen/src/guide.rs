//! One page for each task, from the first object to the data sheet. Every example is compiled and run.
//!
//! 1. [Add an object](add_an_object)
//! 2. [Map a PDO](map_a_pdo)
//! 3. [Store parameters](store_parameters)
//! 4. [Answer LSS](answer_lss)
//! 5. [Write an EDS](write_an_eds)
//! 6. [Be a client](be_a_client)
//! 7. [Drive a motor](drive_a_motor)
//! 8. [Build a gateway](build_a_gateway)

#[doc = include_str!("../docs/add-an-object.md")]
pub mod add_an_object {}

#[doc = include_str!("../docs/map-a-pdo.md")]
pub mod map_a_pdo {}

#[doc = include_str!("../docs/store-parameters.md")]
pub mod store_parameters {}

#[doc = include_str!("../docs/answer-lss.md")]
pub mod answer_lss {}

#[doc = include_str!("../docs/write-an-eds.md")]
pub mod write_an_eds {}

#[doc = include_str!("../docs/be-a-client.md")]
pub mod be_a_client {}

#[doc = include_str!("../docs/drive-a-motor.md")]
pub mod drive_a_motor {}

#[doc = include_str!("../docs/build-a-gateway.md")]
pub mod build_a_gateway {}
