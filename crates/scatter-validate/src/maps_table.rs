//! The second table of `validate`, where a Vulkan device drew the maps: its time beside that of the ray casts.

use std::fmt::Write;

use crate::row::Row;

/// One line a shot whose maps were made by both sources; empty if none were. Depth and shadow maps together, the first
/// time that they are made: a driver compiles its programs then.
pub fn maps_table(rows: &[Row]) -> String {
    let mut text = String::new();
    let mut last = None;
    for row in rows {
        let Some(raycast_ms) = row.raycast_maps_ms.filter(|_| last != Some(&row.shot)) else { continue };
        last = Some(&row.shot);
        if text.is_empty() {
            let _ =
                writeln!(text, "{:<20}  {:>9}  {:>10}  {:>5}", "maps of", "raster ms", "raycast ms", "ratio");
        }
        let ratio = raycast_ms / row.maps_ms;
        let _ = writeln!(text, "{:<20}  {:>9.0}  {raycast_ms:>10.0}  {ratio:>5.1}", row.shot, row.maps_ms);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row::tests::row;

    #[test]
    fn there_is_a_line_a_shot_and_none_without_a_device() {
        let mut rows = [row("a", "nave"), row("b", "nave"), row("a", "lamp")];
        assert_eq!(maps_table(&rows), "");
        for row in &mut rows {
            (row.maps_ms, row.raycast_maps_ms) = (50.0, Some(600.0));
        }
        let text = maps_table(&rows);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), 3);
        assert!(lines[1].starts_with("nave") && lines[1].ends_with("12.0"), "{text}");
        assert_eq!(lines[0].len(), lines[1].len());
    }
}
