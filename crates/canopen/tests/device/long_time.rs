//! Time beyond 32 bits of microseconds: no deadline of a device is early, late or in the past.
