//! Reading measured records, good and bad; interpolation of sampled inputs.

use ident::diagnostics::Code;
use ident::quantities::Unit;
use ident::signal::{DataError, Interpolant, Table, read_table};
use ident::study::Interpolation;
use std::path::PathBuf;

fn unit(text: &str) -> Unit {
    Unit::parse(text).unwrap()
}

fn read_bytes(bytes: &[u8]) -> Result<Table, DataError> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("record.csv");
    std::fs::write(&path, bytes).unwrap();
    read_table(&path)
}

fn read(text: &str) -> Table {
    read_bytes(text.as_bytes()).unwrap()
}

/// Asserts code, line, column and that explanation or help holds `words`.
fn assert_error(error: DataError, code: Code, line: Option<u64>, column: Option<&str>, words: &str) {
    assert_eq!((*error.code, error.line, error.column.as_deref()), (code, line, column), "{error}");
    assert!(error.to_string().contains(words), "`{words}` is not in: {error}");
    assert!(!error.help.is_empty());
}

#[test]
fn columns_are_converted_to_si() {
    let table = read("t [ms],force [kN],angle[deg],remark\n0,1.5,180,start\n10,-2e-1,90,end\n");
    assert_eq!(table.row_count(), 2);
    assert_eq!(table.values("t", &unit("s")).unwrap(), [0.0, 0.01]);
    assert_eq!(table.values("force", &unit("N")).unwrap(), [1500.0, -200.0]);
    assert!((table.values("angle", &unit("rad")).unwrap()[0] - std::f64::consts::PI).abs() < 1e-15);
    assert_eq!(table.values("force [kN]", &unit("N")).unwrap(), [1500.0, -200.0]);
}

#[test]
fn spreadsheet_dialects_mean_the_same() {
    let plain = read("t [s],x [mm]\n0,1.5\n0.1,2.5\n");
    let expected = plain.values("x", &unit("m")).unwrap();
    let semicolons = read("\u{feff}t [s];x [mm]\r\n0;1,5\r\n0,1;2,5\r\n");
    let tabs = read("# logger 7\nt [s]\tx [mm]\n0\t1,5\n0,1\t2,5\n");
    let units_row = read("t;x\ns;mm\n0;1.5\n0.1;2.5\n");
    for table in [semicolons, tabs, units_row] {
        assert_eq!(table.values("x", &unit("m")).unwrap(), expected);
        assert_eq!(table.sampling("t").unwrap().step, 0.1);
    }
    let latin = read_bytes(b"t [s],weg [\xb5m]\n0,1\n1,2\n").unwrap();
    assert_eq!(latin.values("weg", &unit("m")).unwrap(), [1e-6, 2e-6]);
}

#[test]
fn files_that_cannot_be_read() {
    let missing = read_table(&PathBuf::from("no/such/file.csv")).unwrap_err();
    assert_error(missing, Code::DATA_FILE_UNREADABLE, None, None, "there is no data file `no/such/file.csv`");
    let folder = tempfile::tempdir().unwrap();
    assert_error(read_table(folder.path()).unwrap_err(), Code::DATA_FILE_UNREADABLE, None, None, "cannot be read");
    let binary = read_bytes(b"t\0x\0\n").unwrap_err();
    assert_error(binary, Code::DATA_FILE_UNREADABLE, None, None, "UTF-8");
    assert_error(read_bytes(b"").unwrap_err(), Code::DATA_EMPTY, None, None, "empty");
    assert_error(read_bytes(b"t [s],x [m]\n").unwrap_err(), Code::DATA_EMPTY, None, None, "no samples");
    let ragged = read_bytes(b"t [s],x [m]\n0,1\n1\n").unwrap_err();
    assert_error(ragged, Code::DATA_LAYOUT, Some(3), None, "1 cells");
    let doubled = read_bytes(b"x [m],x [m]\n0,1\n").unwrap_err();
    assert_error(doubled, Code::DATA_LAYOUT, Some(1), Some("x"), "two columns");
    let headless = read_bytes(b"0,1\n1,2\n").unwrap_err();
    assert_error(headless, Code::DATA_LAYOUT, Some(1), None, "numbers");
}

#[test]
fn cells_columns_and_units_that_do_not_fit() {
    let table = read("t [s],x [m],y [mm],z\n0,1,2,3\n1,oops,nan,\n2,1.234.5,inf,3\n");
    let metre = unit("m");
    let bad = |name: &str| table.values(name, &metre).unwrap_err();
    assert_error(bad("x"), Code::DATA_NOT_A_NUMBER, Some(3), Some("x"), "`oops` is not a number");
    assert_error(bad("y"), Code::DATA_NOT_FINITE, Some(3), Some("y"), "`nan`");
    assert_error(bad("z"), Code::DATA_NOT_A_NUMBER, Some(3), Some("z"), "empty");
    assert_error(bad("xx"), Code::DATA_COLUMN_MISSING, None, Some("xx"), "did you mean `x`");
    assert_error(bad("pressure"), Code::DATA_COLUMN_MISSING, None, Some("pressure"), "t, x, y, z");
    let table = read("t [s],u [V],n [Hz],w [blorb],p\n0,1,2,3,4\n1,2,3,4,5\n");
    let bad = |name: &str, text: &str| table.values(name, &unit(text)).unwrap_err();
    assert_error(bad("u", "m"), Code::DATA_UNIT, Some(1), Some("u"), "in `V`");
    assert_error(bad("n", "rad/s"), Code::DATA_UNIT, Some(1), Some("n"), "6.283");
    assert_error(bad("w", "m"), Code::DATA_UNIT, Some(1), Some("w"), "blorb");
    assert_error(bad("p", "m"), Code::DATA_UNIT, Some(1), Some("p"), "no unit");
    assert_eq!(table.values("p", &Unit::dimensionless()).unwrap(), [4.0, 5.0]);
}

#[test]
fn time_that_is_no_sampling() {
    let sampling = |times: &[&str]| {
        let rows: String = times.iter().map(|time| format!("{time},1\n")).collect();
        read(&format!("t [s],x [m]\n{rows}")).sampling("t")
    };
    let backward = sampling(&["0", "0.1", "0.2", "0.15"]).unwrap_err();
    assert_error(backward, Code::DATA_TIME_ORDER, Some(5), Some("t"), "backward, from 0.2 s to 0.15 s");
    let repeated = sampling(&["0", "0.1", "0.1"]).unwrap_err();
    assert_error(repeated, Code::DATA_TIME_ORDER, Some(4), Some("t"), "repeated");
    let gap = sampling(&["0", "0.1", "0.2", "0.4", "0.5", "0.6"]).unwrap_err();
    assert_error(gap, Code::DATA_NOT_UNIFORM, Some(5), Some("t"), "missing");
    let changing = sampling(&["0", "0.1", "0.2", "0.32", "0.43", "0.54", "0.65"]).unwrap_err();
    assert_error(changing, Code::DATA_NOT_UNIFORM, Some(5), Some("t"), "resample");
    assert_error(sampling(&["0"]).unwrap_err(), Code::DATA_TOO_SHORT, Some(2), Some("t"), "one sample");
    // Stamps rounded to milliseconds at 60 Hz are a sampling.
    let rounded = sampling(&["0.000", "0.017", "0.033", "0.050", "0.067", "0.083", "0.100"]).unwrap();
    assert!((rounded.rate() - 60.0).abs() < 1e-9 && rounded.jitter < 4e-4);
}

#[test]
fn windows_and_constant_channels() {
    let rows: String = (0..11).map(|k| format!("{},{},{k}\n", 0.1 * f64::from(k), if k < 5 { 7 } else { 8 })).collect();
    let table = read(&format!("t [s],x [m],y [m]\n{rows}"));
    let sampling = table.sampling("t").unwrap();
    assert_eq!(table.window(&sampling, Some((0.2, 0.6)), 3).unwrap(), 2..7);
    assert_eq!(table.window(&sampling, None, 3).unwrap(), 0..11);
    let empty = table.window(&sampling, Some((5.0, 6.0)), 1).unwrap_err();
    assert_error(empty, Code::DATA_TOO_SHORT, None, None, "0 samples");
    assert!(table.require_variation("x", 0..11).is_ok());
    let constant = table.require_variation("x", 0..5).unwrap_err();
    assert_error(constant, Code::DATA_CONSTANT, Some(2), Some("x"), "7 in all 5 samples");
}

/// A finding can be shown as a diagnostic with its place in the data.
#[test]
fn findings_become_diagnostics() {
    let error = read("t [s],x [m]\n0,a\n").values("x", &unit("m")).unwrap_err();
    let diagnostic = error.diagnostic(None);
    let place = diagnostic.data.unwrap();
    assert_eq!((place.line, place.column.as_deref()), (Some(2), Some("x")));
    assert!(diagnostic.message.contains("`a`"));
}

#[test]
fn a_measured_record_of_an_axis() {
    let shared = std::env::var("IDENT_SHARED")
        .map_or_else(|_| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared"), PathBuf::from);
    let path = shared.join("data/emps/est.csv");
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return;
    }
    let table = read_table(&path).unwrap();
    let sampling = table.sampling("t").unwrap();
    assert_eq!(sampling.count, 24_841);
    assert!((sampling.step - 1e-3).abs() < 1e-9 && sampling.jitter < 1e-7, "{sampling:?}");
    let voltage = table.values("u", &unit("V")).unwrap();
    assert_eq!((voltage.len(), voltage[0]), (24_841, 2.53862809));
    assert_error(table.values("u", &unit("N")).unwrap_err(), Code::DATA_UNIT, Some(1), Some("u"), "`V`");
}

const KNOTS: [f64; 8] = [0.3, -1.2, 2.5, 0.7, 0.1, -0.4, 1.9, 1.1];

/// `scipy.interpolate.CubicSpline(0.5 + 0.25 k, KNOTS)` (not-a-knot), SciPy 1.17.1.
#[test]
fn the_spline_agrees_with_scipy() {
    let spline = Interpolant::new(0.5, 0.25, &KNOTS, Interpolation::Cubic);
    let table = [
        (0.5, [0.3, -37.78118022328549, 339.7741626794259]),
        (0.61, [-2.0279629473684215, -6.61511706539075, 226.88153110047853]),
        (0.83, [0.18590989473684136, 18.462440829346093, 1.0962679425837791]),
        (1.27, [0.5644864306220094, -6.018263476874001, 72.46392344497605]),
        (1.9, [0.8642641148325345, 10.979317384370015, 6.141244019138824]),
        (2.2, [1.9260593301435387, -12.261869218500827, -161.08248803827766]),
        (2.25, [1.1, -21.012759170653908, -188.95311004784693]),
    ];
    for (t, expected) in table {
        for (order, reference) in expected.into_iter().enumerate() {
            let error = (spline.evaluate(t, order) - reference).abs();
            assert!(error < 1e-11 * reference.abs().max(1.0), "t = {t}, order {order}: {error:e}");
        }
    }
    let four = Interpolant::new(0.5, 0.25, &KNOTS[..4], Interpolation::Cubic);
    for (order, reference) in [1.0808, 16.309333333333335, -19.52, -684.8].into_iter().enumerate() {
        assert!((four.evaluate(0.9, order) - reference).abs() < 1e-10);
    }
}

/// Not-a-knot splines reproduce cubics; three samples give the parabola, two the line.
#[test]
fn polynomials_are_reproduced() {
    let cubic = |t: f64| 1.0 - 2.0 * t + 0.5 * t * t - 0.25 * t * t * t;
    for count in [4, 5, 9, 40] {
        let values: Vec<f64> = (0..count).map(|k| cubic(0.2 * f64::from(k))).collect();
        let spline = Interpolant::new(0.0, 0.2, &values, Interpolation::Cubic);
        for t in [0.0, 0.11, 0.37, 0.6] {
            assert!((spline.evaluate(t, 0) - cubic(t)).abs() < 1e-12);
            assert!((spline.evaluate(t, 1) - (-2.0 + t - 0.75 * t * t)).abs() < 1e-10);
            assert!((spline.evaluate(t, 2) - (1.0 - 1.5 * t)).abs() < 1e-9);
            assert!((spline.evaluate(t, 3) + 1.5).abs() < 1e-8);
        }
    }
    let parabola = Interpolant::new(0.0, 1.0, &[0.0, 1.0, 4.0], Interpolation::Cubic);
    assert!((parabola.evaluate(1.5, 0) - 2.25).abs() < 1e-14);
    let line = Interpolant::new(0.0, 1.0, &[0.0, 2.0], Interpolation::Cubic);
    assert!((line.evaluate(0.25, 0) - 0.5).abs() < 1e-15);
}

#[test]
fn outside_the_record_the_end_values_are_held() {
    for kind in [Interpolation::Hold, Interpolation::Linear, Interpolation::Cubic] {
        let input = Interpolant::new(0.5, 0.25, &KNOTS, kind);
        assert_eq!((input.evaluate(-3.0, 0), input.evaluate(9.0, 0)), (0.3, 1.1));
        for order in 1..4 {
            assert_eq!((input.evaluate(0.4, order), input.evaluate(2.3, order)), (0.0, 0.0));
        }
        let single = Interpolant::new(0.5, 0.25, &[4.0], kind);
        assert_eq!((single.evaluate(0.0, 0), single.evaluate(0.5, 0), single.evaluate(7.0, 1)), (4.0, 4.0, 0.0));
    }
}

#[test]
fn held_samples_and_lines() {
    let hold = Interpolant::new(0.0, 0.1, &[1.0, 1.0, 5.0, 5.0, 2.0], Interpolation::Hold);
    // 0.1 * 2 and the rounded 0.30000000000000004 mean their samples.
    assert_eq!((hold.evaluate(0.19, 0), hold.evaluate(0.2, 0), hold.evaluate(0.1 + 0.1, 0)), (1.0, 5.0, 5.0));
    assert_eq!((hold.evaluate(0.39, 0), hold.evaluate(0.4, 0), hold.evaluate(0.4, 1)), (5.0, 2.0, 0.0));
    let breaks = hold.breakpoints(0.0, 1.0);
    assert_eq!(breaks.len(), 2);
    assert!((breaks[0] - 0.2).abs() < 1e-15 && (breaks[1] - 0.4).abs() < 1e-15);
    let lines = Interpolant::new(0.0, 1.0, &[0.0, 1.0, 2.0, 0.0], Interpolation::Linear);
    assert_eq!((lines.evaluate(2.25, 0), lines.evaluate(2.25, 1), lines.evaluate(3.0, 1)), (1.5, -2.0, -2.0));
    assert_eq!(lines.breakpoints(0.0, 9.0), [2.0]);
}
