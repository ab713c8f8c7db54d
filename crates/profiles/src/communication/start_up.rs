//! Objects after the PDOs: programs, start-up, multiplexed PDOs (CiA 301, CiA 302-2, CiA 302-3).

use canopen::dictionary::Object;
use canopen::objects;

/// 1F51h to 1FD0h. Program 1 runs.
pub const START_UP: &[Object] = canopen::rows!(
    objects::with(objects::program_control(), 1, 1),
    objects::program_identification(),
    objects::flash_status(),
    [objects::start_up()],
    objects::scanner_list::<9>(),
    objects::dispatching_list::<9>(),
);
