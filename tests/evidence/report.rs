//! Reports: one file that needs no network, with the numbers that the JSON has.

#![allow(clippy::unwrap_used)] // A test that fails may panic.

use super::cli::{text, treadmark};
use serde_json::Value;
use std::path::Path;
use treadmark::report::page::{Block, Digest, Page};

/// A small campaign of a robot whose effective track is not the model's.
fn campaign(folder: &Path) {
    let arguments = [
        "drive",
        "--robot",
        "jnpf_4wd",
        "--protocol",
        "square",
        "--side",
        "1",
        "--set",
        "wheel_diameter_mismatch.ratio_minus_one=0.01",
    ];
    for (name, direction) in [("cw", "cw"), ("ccw", "ccw")] {
        let output = treadmark(folder)
            .args(arguments)
            .args(["--direction", direction, "--no-recording", "--out", name])
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
    }
}

/// No script, no network: nothing is fetched when the file is opened.
fn is_self_contained(html: &str) {
    assert!(html.starts_with("<!DOCTYPE html>"));
    for forbidden in ["<script", "<link", "<img", "@import", "url(", "http://", "https://", "src="] {
        assert!(!html.contains(forbidden), "the report has {forbidden}");
    }
    assert!(
        html.contains("prefers-color-scheme: dark")
            && html.contains("@media print")
            && html.contains("width=device-width")
    );
}

fn json(path: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

#[test]
fn a_diagnosis_report_has_the_numbers_of_its_json_and_is_drawn_again_alike() {
    let folder = tempfile::tempdir().unwrap();
    campaign(folder.path());
    let output = treadmark(folder.path())
        .args([
            "diagnose",
            "cw",
            "ccw",
            "--robot",
            "jnpf_4wd",
            "--most-causes",
            "1",
            "--no-recording",
            "--out",
            "found",
        ])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let found = folder.path().join("found");
    let html = std::fs::read_to_string(found.join("report.html")).unwrap();
    is_self_contained(&html);
    let page: Page = serde_json::from_str(&std::fs::read_to_string(found.join("report.json")).unwrap()).unwrap();
    let json = json(&found.join("diagnosis.json"));

    // Residuals of every condition, in its table.
    let table = |heading: &str| {
        let section = page.sections.iter().find(|section| section.heading == heading).unwrap();
        section.blocks.iter().find_map(|block| if let Block::Table(grid) = block { Some(grid) } else { None }).unwrap()
    };
    let misfit = table("Where the model is wrong");
    let conditions = json["misfit"]["conditions"].as_array().unwrap();
    assert_eq!(misfit.rows.len(), conditions.len());
    for (row, condition) in misfit.rows.iter().zip(conditions) {
        assert_eq!(row[0], condition["condition"].as_str().unwrap());
        for (column, key) in [(2, "x_m"), (3, "y_m"), (4, "heading_rad")] {
            let mean = format!("{:.1} ±", 1e3 * condition[key].as_f64().unwrap());
            assert!(row[column].starts_with(&mean), "{key}: {} against {mean}", row[column]);
            assert!(html.contains(&row[column]));
        }
    }
    // The ranking, best first.
    let ranking = table("What could explain it");
    let best = json["ranking"][0]["log_evidence"].as_f64().unwrap();
    assert_eq!(ranking.rows[0][1], format!("{best:.1}"));
    // The findings, with value and σ.
    let findings = json["findings"].as_array().unwrap();
    if let Some(finding) = findings.first() {
        let name = finding["effect"].as_str().unwrap();
        assert!(page.answer.contains(name), "{}", page.answer);
        assert!(table("What is named").rows[0][0].starts_with(name));
    }
    assert!(!findings.is_empty(), "a hundredth of a diameter is plain to see: {}", page.answer);
    // The terminal says the same.
    let printed = text(&output.stdout);
    assert!(printed.starts_with(&page.answer), "{printed}");
    // The data are the data.
    let digest = Digest::of(&folder.path().join("cw")).unwrap();
    assert_eq!(page.provenance.data[0], digest);
    assert!(html.contains(&digest.sha256) && digest.sha256.len() == 64);

    // Drawn again from what was kept.
    std::fs::remove_file(found.join("report.html")).unwrap();
    let output = treadmark(folder.path()).args(["report", "found"]).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(std::fs::read_to_string(found.join("report.html")).unwrap(), html);
}

/// What is wrong with the data themselves stands before all that is said of them, and is said before the work begins.
#[test]
fn a_diagnosis_says_first_what_is_wrong_with_the_data() {
    let folder = tempfile::tempdir().unwrap();
    campaign(folder.path());
    let poses = folder.path().join("cw/poses.csv");
    let rows = std::fs::read_to_string(&poses).unwrap();
    let in_millimetres = |row: &str| {
        let mut cells: Vec<String> = row.split(',').map(str::to_owned).collect();
        for cell in &mut cells[2..4] {
            if let Ok(value) = cell.parse::<f64>() {
                *cell = format!("{}", 1e3 * value);
            }
        }
        cells.join(",")
    };
    let wrong: Vec<String> = rows.lines().map(in_millimetres).collect();
    std::fs::write(&poses, wrong.join("\n")).unwrap();
    let output = treadmark(folder.path())
        .args(["diagnose", "cw", "--robot", "jnpf_4wd", "--most-causes", "1", "--no-recording", "--out", "found"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let caution = "millimetres or centimetres. Write metres";
    let (printed, told) = (text(&output.stdout), text(&output.stderr));
    assert!(told.starts_with("look at the data first: ") && told.contains(caution), "{told}");
    assert!(printed.starts_with("Look at the data first. ") && printed.contains(caution), "{printed}");
    let found = folder.path().join("found");
    assert!(std::fs::read_to_string(found.join("report.html")).unwrap().contains(caution));
    let suspicions = &json(&found.join("diagnosis.json"))["looks_wrong"][0]["suspicions"];
    assert_eq!((suspicions[0]["kind"].as_str(), suspicions.as_array().unwrap().len()), (Some("way_unit"), 1));
}

#[test]
fn a_sweep_report_has_the_numbers_of_its_table() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    let folder = tempfile::tempdir().unwrap();
    let plan = "format = \"treadmark-sweep/1\"\npoint = \"run\"\nrepeats = 2\ntime_step_s = 0.0025\n\
        [protocol]\nkind = \"straight\"\nlength_m = 0.2\n\
        [[grid]]\nparameter = \"wheel_diameter_mismatch.ratio_minus_one\"\nvalues = [0.0, 0.02, 0.04]\n\
        [[grid]]\nparameter = \"protocol.direction\"\nvalues = [\"forward\", \"reverse\"]\n";
    std::fs::write(folder.path().join("plan.toml"), plan).unwrap();
    let run = |arguments: &[&str]| {
        let output = treadmark(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
    };
    run(&["sweep", "plan.toml", "--out", "swept"]);
    run(&["report", "swept"]);
    // A result that is drawn is drawn again.
    run(&["report", "swept"]);
    let swept = folder.path().join("swept");
    let html = std::fs::read_to_string(swept.join("report.html")).unwrap();
    is_self_contained(&html);

    let table = SerializedFileReader::new(std::fs::File::open(swept.join("sweep.parquet")).unwrap()).unwrap();
    let names: Vec<String> =
        table.metadata().file_metadata().schema().get_fields().iter().map(|field| field.name().to_owned()).collect();
    let column = |name: &str| names.iter().position(|known| known == name).unwrap();
    let mut errors: Vec<f64> = table
        .get_row_iter(None)
        .unwrap()
        .map(|row| {
            let row = row.unwrap();
            let of =
                |name: &str| row.get_column_iter().nth(column(name)).unwrap().1.to_string().parse::<f64>().unwrap();
            1e3 * of("error_x_m").hypot(of("error_y_m"))
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    assert_eq!(errors.len(), 12);
    let (least, greatest) = (format!("{:.1}", errors[0]), format!("{:.1}", errors[11]));
    let median = format!("{:.1} mm off in the median", 0.5 * (errors[5] + errors[6]));
    for words in
        [&least, &greatest, &median, "Over 12 runs", "position error over wheel_diameter_mismatch.ratio_minus_one"]
    {
        assert!(html.contains(words), "{words}");
    }
    // Both ways, a dot a point in each of two charts; the plan is in the page.
    assert_eq!(html.matches("<circle class=\"ccw dot pale\"").count(), 2 * 6 + 1);
    assert_eq!(html.matches("<circle class=\"cw dot pale\"").count(), 2 * 6 + 1);
    assert!(html.contains("values = [0.0, 0.02, 0.04]"));
    assert!(html.contains("treadmark sweep plan.toml"));
}

#[test]
fn a_dataset_report_says_what_check_says() {
    let folder = tempfile::tempdir().unwrap();
    campaign(folder.path());
    let before: Vec<_> = std::fs::read_dir(folder.path().join("cw")).unwrap().collect();
    let output = treadmark(folder.path()).args(["report", "cw", "--out", "cw.html"]).output().unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let html = std::fs::read_to_string(folder.path().join("cw.html")).unwrap();
    is_self_contained(&html);
    let check = treadmark(folder.path()).args(["check", "cw", "--json"]).output().unwrap();
    let check: Value = serde_json::from_slice(&check.stdout).unwrap();
    for suspicion in check["suspicions"].as_array().unwrap() {
        assert!(html.contains(suspicion["message"].as_str().unwrap()));
    }
    assert!(html.contains("1 run with a surveyed end") && check["runs"] == 1);
    assert!(html.contains("square of 1 m, cw"));
    // Nothing is added to a lab's data, nothing is overwritten.
    assert_eq!(std::fs::read_dir(folder.path().join("cw")).unwrap().count(), before.len());
    let again = treadmark(folder.path()).args(["report", "cw", "--out", "cw.html"]).output().unwrap();
    assert!(!again.status.success() && text(&again.stderr).contains("never overwritten"));
    let nothing = treadmark(folder.path()).args(["report", "."]).output().unwrap();
    assert!(!nothing.status.success() && text(&nothing.stderr).contains("neither"));
}

#[test]
fn experiment_and_calibration_reports_have_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let output = treadmark(folder.path())
        .args(["experiment", "--sides", "1", "--repeats", "2", "--method", "umbmark,maximum_likelihood"])
        .args(["--no-recording", "--json", "--out", "squares"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let html = std::fs::read_to_string(folder.path().join("squares/report.html")).unwrap();
    is_self_contained(&html);
    assert!(html.contains("wheel_separation_multiplier"));
    for method in printed["methods"].as_array().unwrap() {
        assert!(html.contains(&format!("{:.1} ×", method["improvement"].as_f64().unwrap())));
    }
    for side in printed["before"].as_array().unwrap() {
        assert!(html.contains(&format!("{:.1}", 1e3 * side["e_max_syst_m"].as_f64().unwrap())));
    }

    let output = treadmark(folder.path())
        .args(["calibrate", "squares/before", "--out", "calibrated", "--json"])
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output.stderr));
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    let html = std::fs::read_to_string(folder.path().join("calibrated/report.html")).unwrap();
    is_self_contained(&html);
    for method in printed["methods"].as_array().unwrap().iter().filter(|method| method["applicable"] == true) {
        assert!(
            html.contains(&format!("{:.1} mm", 1e3 * method["in_sample"]["position_rmse_after_m"].as_f64().unwrap()))
        );
    }
    assert_eq!(json(&folder.path().join("calibrated/calibration.json")), printed);
}
