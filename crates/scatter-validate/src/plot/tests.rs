//! The plot as a whole: well-formed, legible, without anything from elsewhere.

use super::*;

fn plot() -> Plot {
    let curve = |name: &str, is_baseline, look, scale: f64| Curve {
        name: name.into(),
        is_baseline,
        line: [0.3, 3.0, 40.0].map(|x| [x, scale / x]).to_vec(),
        points: [(0.3, Mark::Full), (3.0, Mark::Hollow), (40.0, Mark::Small)]
            .map(|(x, mark)| Point { at: [x, scale / x], name: format!("{x} & \"so\" <on>"), mark })
            .to_vec(),
        look,
    };
    Plot {
        title: "a <b> & 'c'".into(),
        description: "errors \"fall\"\u{7} with time".into(),
        x: Axis { label: "error [%]".into() },
        y: Axis { label: "time [ms]".into() },
        guides: vec![Guide { at: 1.0, name: "film".into() }, Guide { at: 0.0, name: "nowhere".into() }],
        curves: vec![
            curve("march", true, 0, 90.0),
            curve("s<l>ices", false, 1, 9.0),
            curve("x", false, 7, 2.0),
        ],
        notes: vec!["filled: nothing is both faster & more exact".into()],
    }
}

/// Walks through a document of elements, attributes and text, and returns all attributes. Panics where it is not
/// well-formed: a tag that is not closed in its order, an attribute without quotes or twice, a bare `<` or `&`.
#[track_caller]
fn attributes(document: &str) -> Vec<(String, String)> {
    let (mut open, mut found, mut roots) = (Vec::new(), Vec::new(), 0);
    let mut rest = document;
    while let Some(start) = rest.find('<') {
        check_text(&rest[..start]);
        assert!(!open.is_empty() || rest[..start].trim().is_empty(), "text outside of the root");
        let (tag, after) = rest[start + 1..].split_once('>').expect("a tag ends");
        rest = after;
        if let Some(name) = tag.strip_prefix('/') {
            assert_eq!(open.pop(), Some(name.to_string()), "closed in order");
            continue;
        }
        let (tag, is_empty) = tag.strip_suffix('/').map_or((tag, false), |tag| (tag, true));
        let (name, mut pairs) = tag.split_once(' ').unwrap_or((tag, ""));
        assert!(name.chars().all(|c| c.is_ascii_alphanumeric()) && !name.is_empty(), "{name}");
        let mut names = Vec::new();
        while !pairs.trim().is_empty() {
            let (key, value) = pairs.trim_start().split_once("=\"").expect("a quoted attribute");
            let (value, after) = value.split_once('"').expect("its end");
            assert!(after.is_empty() || after.starts_with([' ', '\n']), "space between attributes");
            assert!(
                key.chars().all(|c| c.is_ascii_alphanumeric() || c == '-') && !names.contains(&key),
                "{key}"
            );
            check_text(value);
            names.push(key);
            found.push((key.to_string(), value.to_string()));
            pairs = after;
        }
        roots += usize::from(open.is_empty());
        if !is_empty {
            open.push(name.to_string());
        }
    }
    assert!(open.is_empty() && roots == 1 && rest.trim().is_empty(), "{open:?}");
    found
}

#[track_caller]
fn check_text(text: &str) {
    assert!(!text.contains('<') && text.chars().all(|c| c == '\n' || !c.is_control()), "{text}");
    for entity in text.split('&').skip(1) {
        let name = entity.split_once(';').map(|(name, _)| name);
        assert!(matches!(name, Some("amp" | "lt" | "gt" | "quot" | "#39")), "a bare & in {text}");
    }
}

#[test]
fn svg_is_well_formed_inline_and_as_a_file() {
    attributes(&plot().inline_svg());
    attributes(&svg_file(&[plot(), plot(), plot()], 2));
    attributes(&svg_file(&[], 2));
    let mut empty = plot();
    empty.curves.clear();
    empty.guides.clear();
    attributes(&empty.inline_svg());
}

#[test]
fn the_checker_itself_refuses_what_is_malformed() {
    for wrong in
        ["<a><b></a></b>", "<a x=1/>", "<a>&b</a>", "<a x=\"1\" x=\"2\"/>", "<a>", "<a/><b/>", "<a/>b"]
    {
        assert!(std::panic::catch_unwind(|| attributes(wrong)).is_err(), "{wrong}");
    }
}

#[test]
fn every_number_is_finite_and_every_font_legible() {
    let mut plot = plot();
    // What a logarithm cannot show is left out.
    for x in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        plot.curves[1].line.push([x, 1.0]);
        plot.curves[1].points.push(Point { at: [1.0, x], name: String::new(), mark: Mark::Full });
    }
    let svg = plot.inline_svg();
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    let sizes: Vec<f64> = attributes(&svg)
        .into_iter()
        .filter(|(key, _)| key == "font-size")
        .map(|(_, value)| value.parse().unwrap())
        .collect();
    assert!(sizes.len() > 10 && sizes.iter().all(|&size| size >= MIN_FONT), "{sizes:?}");
}

#[test]
fn everything_lies_inside_of_its_picture() {
    let plot = plot();
    for (key, value) in attributes(&plot.inline_svg()) {
        let limit = match key.as_str() {
            "x" | "x1" | "x2" | "cx" => WIDTH,
            "y" | "y1" | "y2" | "cy" => plot.height(),
            _ => continue,
        };
        let value: f64 = value.parse().unwrap();
        assert!((0.0..=limit).contains(&value), "{key}={value}");
    }
}

#[test]
fn a_page_takes_it_as_it_is() {
    let svg = plot().inline_svg();
    // A report must not name anything outside of itself, and two plots on a page must not share an id.
    for forbidden in ["<script", "http", "url(", " id=", "<style", "href"] {
        assert!(!svg.contains(forbidden), "{forbidden}");
    }
    assert!(svg_file(&[plot()], 1).starts_with("<svg xmlns=\"http://www.w3.org/2000/svg\" "));
}

#[test]
fn curves_differ_in_colour_dash_and_shape() {
    let looks: Vec<String> = (0..6)
        .map(|look| {
            let mut svg = String::new();
            let curve =
                Curve { name: "c".into(), is_baseline: false, line: Vec::new(), points: Vec::new(), look };
            curve.legend_entry(&mut svg, [0.0, 0.0]);
            svg
        })
        .collect();
    for (index, look) in looks.iter().enumerate() {
        assert!(!looks[..index].contains(look), "{index}");
    }
}
