//! Tables as functions and as laws.

use crate::evaluate::{close, study, value};
use ident::diagnostics::{Code, render};
use ident::study::{Study, check, load};
use std::fs;

const SLIDE: &str = "study s\nbody b { mass = 2 kg }\njoint guide: prismatic(z) ground -> b\n\
    measure z [mm] = guide.position\n";

fn load_at(study: &Study, v: f64) -> f64 {
    let force = study.forces.iter().find(|force| force.name == "d").expect("the force");
    value(study, force.load, &[("guide.velocity", v)])
}

fn curve(interpolation: &str, extrapolation: &str) -> Study {
    study(&format!(
        "{SLIDE}table curve(v: rate) -> load {{
           points = ((-1 m/s, 2 kN), (-500 mm/s, 1.5), (0, 0), (0.5, -1.5), (1, -1.6))
           interpolation = {interpolation}, extrapolation = {extrapolation}
         }}
         force d: curve on guide"
    ))
}

#[test]
fn tables_pass_their_points_and_go_on_beyond_them() {
    for interpolation in ["linear", "monotone", "cubic"] {
        for (extrapolation, beyond) in [("constant", Some(-1600.0)), ("linear", None), ("error", None)] {
            let study = curve(interpolation, extrapolation);
            let points = [(-1.0, 2000.0), (-0.5, 1500.0), (0.0, 0.0), (0.5, -1500.0), (1.0, -1600.0)];
            for (v, load) in points {
                assert!((load_at(&study, v) - load).abs() < 1e-9, "{interpolation} {extrapolation} at {v}");
            }
            if let Some(beyond) = beyond {
                close(load_at(&study, 3.0), beyond);
                close(load_at(&study, -3.0), 2000.0);
            }
            assert_eq!(load_at(&study, 1.1).is_nan(), extrapolation == "error");
        }
    }
    // The slope of the last piece goes on.
    close(load_at(&curve("linear", "linear"), 2.0), -1800.0);
    close(load_at(&curve("linear", "linear"), -2.0), 3000.0);
    close(load_at(&curve("linear", "constant"), 0.25), -750.0);
}

/// Between its points the derivative of the expression is that of the curve.
#[test]
fn derivatives_follow() {
    for interpolation in ["linear", "monotone", "cubic"] {
        let mut study = curve(interpolation, "linear");
        let load = study.forces[0].load;
        let rate = study.forces[0].rate;
        let slope = study.graph.differentiate(&[load], rate)[0];
        for v in [-1.7, -0.8, -0.3, 0.2, 0.77, 1.4] {
            let numeric = (load_at(&study, v + 1e-6) - load_at(&study, v - 1e-6)) / 2e-6;
            let exact = value(&study, slope, &[("guide.velocity", v)]);
            assert!((numeric - exact).abs() < 1e-3 * exact.abs().max(1.0), "{interpolation} at {v}: {numeric} {exact}");
        }
    }
}

/// A table is a function of any expression, and as a law it has a factor that can be identified.
#[test]
fn tables_serve_in_laws_and_formulas() {
    let study = study(&format!(
        "{SLIDE}table damping(v: velocity) -> force {{ points = ((0 m/s, 0 N), (1, 10), (2, 12)),
           interpolation = linear, extrapolation = linear }}
         table stiffening(x: length) -> ratio {{ points = ((0 mm, 1), (10, 1.5)), interpolation = linear,
           extrapolation = constant }}
         law symmetric(x: coordinate, v: rate) -> load {{ = -sign(v) * damping(abs(v)) * stiffening(abs(x)) }}
         force d: symmetric on guide
         force e: damping on guide {{ factor = -2 }}
         signal worn = damping(2 * guide.velocity)
         measure w [N] = worn
         identify {{ e.factor in -9 .. 9 from -2 }}"
    ));
    let at =
        |node, x: f64, v: f64| value(&study, node, &[("guide.position", x), ("guide.velocity", v), ("e.factor", -3.0)]);
    close(at(study.forces[0].load, 0.005, -1.0), 12.5);
    close(at(study.forces[1].load, 0.0, 0.5), -15.0);
    close(at(study.measures.iter().find(|measure| measure.name == "w").expect("w").value, 0.0, 0.75), 11.0);
}

#[test]
fn tables_come_from_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("writable folder");
    let table = "table curve(v: rate) -> load { file = \"curve.csv\", interpolation = linear, extrapolation = error }\n\
                 force d: curve on guide\n";
    write("s.ident", &format!("{SLIDE}{table}"));
    write("curve.csv", "v [mm/s];F [kN]\n# measured cold\n-1000;1,5\n0;0\n500;-1\n");
    let read = || {
        let loaded = load(&folder.path().join("s.ident"));
        check(&loaded, None).map_err(|findings| (render(&findings, &loaded.sources, false), findings))
    };
    let study = read().unwrap_or_else(|(text, _)| panic!("{text}")).study;
    close(load_at(&study, -0.5), 750.0);
    close(load_at(&study, 0.25), -500.0);
    write("map.csv", "x [mm],v [m/s],F [kN]\n0,0,0\n10,0,1\n0,1,2\n10,1,4\n");
    let surface = "table curve(x: length, v: velocity) -> force { file = \"map.csv\", interpolation = linear, extrapolation = error }\n\
                   force d: curve on guide\n";
    write("s.ident", &format!("{SLIDE}{surface}"));
    close(load_on(&read().unwrap_or_else(|(text, _)| panic!("{text}")).study, 0.005, 0.5), 1750.0);
    write("s.ident", &format!("{SLIDE}{table}"));
    for (text, code, told) in [
        ("v [mm/s],F [kN]\n0,0\n1,x\n", Code::TABLE_FILE, "`1`, `x` are not two numbers"),
        ("v [mm/s],F [kN],T [degC]\n0,0,1\n", Code::TABLE_FILE, "3 cells instead of two"),
        ("0,1\n1,2\n", Code::TABLE_FILE, "holds numbers instead of names"),
        ("v [mm/s],F [kM]\n0,1\n", Code::TABLE_FILE, "kM"),
        ("v [mm/s],F [kN]\n0,1\n0,2\n", Code::TABLE_POINTS, "do not grow from point 1 to point 2"),
        ("v [mm/s],F [kN]\n0,1\n", Code::TABLE_POINTS, "at least two points"),
        ("v [mm],F [kN]\n0,1\n1,2\n", Code::DIMENSION_MISMATCH, "do not have the declared types"),
        ("", Code::TABLE_FILE, "empty"),
    ] {
        write("curve.csv", text);
        let (shown, findings) = read().expect_err(text);
        assert!(findings.iter().any(|finding| finding.code == code), "{shown}");
        assert!(shown.contains(told), "{shown}");
    }
    fs::remove_file(folder.path().join("curve.csv")).expect("removable");
    let (shown, findings) = read().expect_err("a missing file");
    assert!(findings.iter().any(|finding| finding.code == Code::CANNOT_READ_FILE), "{shown}");
}

/// A road or track of thousands of points is read and evaluated in reasonable time.
#[test]
fn long_tables_are_treated() {
    let points: Vec<String> = (0..4000).map(|at| format!("({at} m, {} mm)", f64::from(at % 17) * 0.1)).collect();
    let text = format!(
        "{SLIDE}table track(s: length) -> length {{ points = ({}), interpolation = monotone, extrapolation = constant }}\n\
         signal height = track(20 m/s * t - 2.5 m)\nmeasure h [mm] = height",
        points.join(", ")
    );
    let begin = std::time::Instant::now();
    let study = study(&text);
    assert!(begin.elapsed().as_secs_f64() < 10.0, "{:?}", begin.elapsed());
    let height = study.measures.iter().find(|measure| measure.name == "h").expect("the measure").value;
    close(value(&study, height, &[("t", 0.125 + 16.0 / 20.0)]), 1.6e-3);
}

/// A record of hundreds of thousands of points is no part of the equations: it compiles as fast as a short one and is
/// run over.
#[test]
fn records_of_any_length_are_treated() {
    use ident::simulation::{Compiled, Gradient, manoeuvre, simulate};
    let folder = tempfile::tempdir().expect("a folder");
    let height = |s: f64| 0.01 * (3.0 * s).sin();
    let rows: String =
        (0..=200_000).map(|k| 0.0005 * f64::from(k)).map(|s| format!("{s},{:e}\n", 1e3 * height(s))).collect();
    fs::write(folder.path().join("track.csv"), format!("s [m],z [mm]\n{rows}")).expect("writable folder");
    let path = folder.path().join("s.ident");
    let text = "study s
        input u [mm]
        table track(s: length) -> length { file = \"track.csv\", interpolation = cubic, extrapolation = error }
        body b { mass = 2 kg }
        joint guide: prismatic(z) ground -> b
        signal way: travelled { speed = 20 m/s }
        force contact: following_spring on guide { stiffness = 200 N/m, height = track(way) }
        measure h [m] = track(way)
        measure direct [m] = u
        measure z [m] = guide.position
        manoeuvre go { u = track(20 m/s * t), for 4 s, step = 10 ms, start = rest }
        criterion c = max(guide.position) in go
        solver { tolerance = 1e-9 }";
    fs::write(&path, text).expect("writable folder");
    let checked = check(&load(&path), None).unwrap_or_else(|findings| panic!("{findings:?}"));
    let compiled = Compiled::new(checked.study).unwrap_or_else(|findings| panic!("{findings:?}"));
    assert!(compiled.system.graph.len() < 1000, "{} nodes", compiled.system.graph.len());
    let mut record = manoeuvre(&compiled.study, 0);
    record.measures = vec![0, 1, 2];
    let run = simulate(&compiled, &record, &[], Gradient::None).unwrap_or_else(|failure| panic!("{failure:?}"));
    // z'' + 100 z = 100 h(20 t) from rest.
    let (own, forced) = (10.0_f64, 60.0_f64);
    let amplitude = 0.01 * own * own / (own * own - forced * forced);
    for (k, t) in record.times.iter().enumerate() {
        let z = amplitude * ((forced * t).sin() - forced / own * (own * t).sin());
        assert!(
            (run.channels[0][k] - height(20.0 * t)).abs() < 1e-9
                && (run.channels[1][k] - height(20.0 * t)).abs() < 1e-9
        );
        assert!((run.channels[2][k] - z).abs() < 1e-7, "at {t}: {} instead of {z}", run.channels[2][k]);
    }
}

/// A run that starts exactly where the table begins, and one that comes back there and leaves it.
#[test]
fn runs_start_at_the_edge_of_a_table() {
    use ident::simulation::{Compiled, Gradient, manoeuvre, simulate};
    let study = study(
        "study s
         table track(s: length) -> length {
           points = ((0 m, 0 mm), (1 m, 10 mm), (2 m, 0 mm)), interpolation = linear, extrapolation = constant
         }
         body wheel { mass = 500 kg }
         joint guide: prismatic(z) ground -> wheel
         signal way: travelled { speed = (1.5 m/s) * cos(2 rad/s * t) }
         force contact: following_spring on guide { stiffness = 1 MN/m, height = track(way) }
         force damper: damper on guide { damping = 20 kN*s/m }
         measure z [mm] = guide.position
         measure s [m] = way
         manoeuvre go { for 3 s, step = 5 ms, start = rest }
         criterion c = max(guide.position) in go",
    );
    let compiled = Compiled::new(study).unwrap_or_else(|findings| panic!("{findings:?}"));
    let mut record = manoeuvre(&compiled.study, 0);
    record.measures = vec![0, 1];
    let run = simulate(&compiled, &record, &[], Gradient::None).unwrap_or_else(|failure| panic!("{failure:?}"));
    let (height, way) = (&run.channels[0], &run.channels[1]);
    assert!(way.iter().any(|s| *s > 0.7) && way.iter().any(|s| *s < -0.5), "within the table and beyond its edge");
    // Beyond the edge the wheel comes to rest on the first point.
    assert!(height.last().is_some_and(|z| z.abs() < 1e-3), "{:?}", height.last());
    assert!(height.iter().any(|z| *z > 6e-3));
}

/// A map of load over stroke and rate, by this formula at the points of its grid.
fn map(interpolation: &str, extrapolation: &str, of: impl Fn(f64, f64) -> f64) -> Study {
    let grid: Vec<(f64, f64)> = (0..6).flat_map(|i| (0..5).map(move |j| (f64::from(i), f64::from(j)))).collect();
    // In the text in no particular order.
    let points: Vec<String> = (0..grid.len())
        .map(|at| grid[(at * 7) % grid.len()])
        .map(|(i, j)| (0.02 * i - 0.05, 0.5 * j - 1.0))
        .map(|(x, v)| format!("({x:e} m, {v:e} m/s, {:e} N)", of(x, v)))
        .collect();
    study(&format!(
        "{SLIDE}table map(x: coordinate, v: rate) -> load {{
           points = ({}), interpolation = {interpolation}, extrapolation = {extrapolation}
         }}
         force d: map on guide",
        points.join(", ")
    ))
}

fn load_on(study: &Study, x: f64, v: f64) -> f64 {
    value(study, study.forces[0].load, &[("guide.position", x), ("guide.velocity", v)])
}

#[test]
fn surfaces_pass_their_points_and_go_on_beyond_them() {
    let rough = |x: f64, v: f64| 3e3 * (40.0 * x).sin() * (2.0 + v * v) - 500.0 * v;
    for interpolation in ["linear", "cubic"] {
        for extrapolation in ["constant", "linear", "error"] {
            let study = map(interpolation, extrapolation, rough);
            for i in 0..6 {
                for j in 0..5 {
                    let (x, v) = (0.02 * f64::from(i) - 0.05, 0.5 * f64::from(j) - 1.0);
                    let own = load_on(&study, x, v);
                    assert!((own - rough(x, v)).abs() < 1e-6, "{interpolation} {extrapolation} at {x}, {v}: {own}");
                }
            }
            assert_eq!(load_on(&study, 0.06, 0.0).is_nan(), extrapolation == "error");
            assert_eq!(load_on(&study, 0.0, -1.1).is_nan(), extrapolation == "error");
            if extrapolation == "constant" {
                close(load_on(&study, 0.2, 3.0), load_on(&study, 0.05, 1.0));
                close(load_on(&study, 0.01, -3.0), load_on(&study, 0.01, -1.0));
            }
        }
    }
    // Bilinear functions are met everywhere, also beyond the grid; derivatives by both arguments follow.
    let plain = |x: f64, v: f64| 5.0 - 3e3 * x - 700.0 * v + 8e3 * x * v;
    for interpolation in ["linear", "cubic"] {
        let mut study = map(interpolation, "linear", plain);
        let (load, rate) = (study.forces[0].load, study.forces[0].rate);
        let slope = study.graph.differentiate(&[load], rate)[0];
        for (x, v) in [(0.013, 0.2), (-0.049, -0.9), (0.08, 0.3), (0.02, 1.7), (-0.09, -2.0), (0.3, 4.0)] {
            assert!((load_on(&study, x, v) - plain(x, v)).abs() < 1e-6, "{interpolation} at {x}, {v}");
            let own = value(&study, slope, &[("guide.position", x), ("guide.velocity", v)]);
            assert!((own - (8e3 * x - 700.0)).abs() < 1e-6, "{interpolation} at {x}, {v}: {own}");
        }
    }
    // Cubic surfaces are nearer to smooth functions than linear ones.
    let error = |interpolation: &str| {
        let study = map(interpolation, "error", rough);
        let places = [(-0.02, -0.2), (0.003, 0.3), (0.017, -0.4), (-0.013, 0.1)];
        places.iter().map(|&(x, v)| (load_on(&study, x, v) - rough(x, v)).abs()).fold(0.0, f64::max)
    };
    assert!(error("cubic") < 0.25 * error("linear"), "{} {}", error("cubic"), error("linear"));
}

#[test]
fn faulty_surfaces_are_told() {
    let told = |points: &str, more: &str| {
        let text = format!(
            "{SLIDE}table map(x: length, v: velocity) -> force {{ points = ({points}), interpolation = {more}, extrapolation = error }}"
        );
        let loaded = ident::study::load_text("s", &text);
        let findings = check(&loaded, None).expect_err("a fault");
        render(&findings, &loaded.sources, false)
    };
    for (points, more, message) in [
        ("(0 m, 0 m/s, 1 N), (1, 0, 2), (0, 1, 3)", "linear", "there is no point of 1 and 1"),
        ("(0 m, 0 m/s, 1 N), (1, 0, 2), (0, 1, 3), (1, 1, 4), (1, 0, 9)", "linear", "is there twice"),
        ("(0 m, 0 m/s, 1 N), (1, 0, 2)", "linear", "at least two values of each"),
        ("(0 m, 0 m/s), (1, 0)", "linear", "a point is two arguments and a value"),
        ("(0 m, 0 m, 1 N), (1, 0, 2), (0, 1, 3), (1, 1, 4)", "linear", "from m and m to N"),
        ("(0 m, 0 m/s, 1 N), (1, 0, 2), (0, 1, 3), (1, 1, 4)", "monotone", "cannot be `monotone`"),
    ] {
        let shown = told(points, more);
        assert!(shown.contains(message), "{points}\n{shown}");
    }
}
