//! TPDO 1 with the default mapping: the contents of 1A00h in the delivered firmware.

use crate::personality::Personality;
use crate::status::NodeStatus;
use crate::traffic::Unit;

/// The first value of the last TPDO 1 with its unit. A PDO with another mapping is shown as bytes.
pub(super) fn value(node: &NodeStatus) -> String {
    let Some(data) = &node.heard.tpdo1 else { return "none".to_owned() };
    match (node.personality, data.as_slice()) {
        // Two process values; the unit of the first is in 6131h.
        (Personality::Pressure, &[a, b, c, d, _, _, _, _]) => {
            format!("{:.3} {}", f32::from_le_bytes([a, b, c, d]), unit(node.heard.unit)).trim_end().to_owned()
        }
        // 6004h.
        (Personality::Encoder | Personality::Combined, &[a, b, c, d]) => {
            format!("{} units", u32::from_le_bytes([a, b, c, d]))
        }
        (_, bytes) => bytes.iter().map(|byte| format!("{byte:02X}")).collect(),
    }
}

/// The symbol of a unit (CiA 303-2); empty where it is not known.
fn unit(unit: Unit) -> String {
    let code = match unit {
        Unit::Delivered => return "bar".to_owned(),
        Unit::Unknown => return String::new(),
        Unit::Code(code) => code,
    };
    wire::unit::symbol(code)
}

#[cfg(test)]
mod tests {
    use canbus::Time;

    use super::*;
    use crate::traffic::Heard;

    fn shown(personality: Personality, data: Option<&[u8]>) -> String {
        shown_with(personality, Heard { tpdo1: data.map(<[u8]>::to_vec), ..Heard::default() })
    }

    fn shown_with(personality: Personality, heard: Heard) -> String {
        let (pressure, temperature, position, awake) = (0.0, 0.0, 0.0, Time::ZERO);
        value(&NodeStatus { id: 1, node_id: 1, personality, heard, pressure, temperature, position, awake })
    }

    #[test]
    fn each_personality_has_its_value_and_its_unit() {
        let pressure = [2.5_f32.to_le_bytes(), 25.0_f32.to_le_bytes()].concat();
        assert_eq!(shown(Personality::Pressure, Some(&pressure)), "2.500 bar");
        let heard = |unit| Heard { tpdo1: Some(pressure.clone()), unit, ..Heard::default() };
        assert_eq!(shown_with(Personality::Pressure, heard(Unit::Code(0x0322_0000))), "2.500 kPa");
        assert_eq!(shown_with(Personality::Pressure, heard(Unit::Unknown)), "2.500");
        assert_eq!(shown(Personality::Encoder, Some(&4782_u32.to_le_bytes())), "4782 units");
        assert_eq!(shown(Personality::Combined, Some(&1_u32.to_le_bytes())), "1 units");
    }

    #[test]
    fn other_mappings_are_shown_as_bytes() {
        assert_eq!(shown(Personality::Pressure, Some(&[0x12, 0xAB])), "12AB");
        assert_eq!(shown(Personality::Encoder, Some(&[])), "");
        assert_eq!(shown(Personality::Lift, None), "none");
    }
}
