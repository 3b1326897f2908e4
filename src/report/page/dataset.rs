//! The report of a dataset before anyone calculates: what was driven, where it ended, what looks wrong.

use super::{Block, FORMAT, Hue, Mark, Page, Plane, Provenance, Section, Shape};
use crate::calibrate::Suspicion;
use crate::dataset::{Dataset, Run};
use crate::report::check;

/// Points that are drawn of a way.
const MOST_POINTS: usize = 200;

/// The page of `dataset`, in which `suspicions` were found.
pub fn page(dataset: &Dataset, suspicions: &[Suspicion], provenance: Provenance) -> Page {
    let campaign = &dataset.campaign;
    let surveyed = dataset.runs.iter().filter(|run| run.end.is_some()).count();
    let runs = match (dataset.runs.len(), surveyed) {
        (all, surveyed) if all == surveyed => format!("{} with a surveyed end", check::counted(all, "run")),
        (all, surveyed) => format!("{}, {surveyed} of them with a surveyed end", check::counted(all, "run")),
    };
    let answer = match suspicions.len() {
        0 => format!("{runs}; nothing looks wrong."),
        1 => format!("{runs}; one thing looks wrong."),
        many => format!("{runs}; {many} things look wrong."),
    };
    let facts = [&campaign.description, &campaign.source, &campaign.licence, &campaign.survey.method];
    let labels = ["", "Source: ", "Licence: ", "Survey: "];
    let facts = labels.iter().zip(facts).filter_map(|(label, fact)| Some(format!("{label}{}", fact.as_ref()?)));
    let sections = [
        Section::of(
            "What looks wrong",
            vec![Block::List(suspicions.iter().map(ToString::to_string).collect())],
        ),
        Section::of("What was driven", vec![
            Block::List(facts.collect()),
            Block::Table(check::driven(dataset)),
            Block::Planes(planes(dataset)),
        ]),
        Section::of("Where it ended", vec![Block::List(check::ends(dataset))]),
        Section::of("Next", vec![Block::Text(
            "`treadmark calibrate` finds wheel diameters and track; `treadmark diagnose` says what a model gets wrong, and why.".to_owned(),
        )]),
    ];
    Page {
        format: FORMAT.to_owned(),
        title: campaign.name.clone(),
        answer,
        beside: Vec::new(),
        sections: sections.into_iter().flatten().collect(),
        provenance,
    }
}

/// Surveyed ways and ends, a figure a kind of run \[m\].
fn planes(dataset: &Dataset) -> Vec<Plane> {
    let mut planes: Vec<Plane> = Vec::new();
    for run in &dataset.runs {
        let kind = check::kind(run);
        let marks = marks(run, dataset);
        match planes.iter_mut().find(|plane| plane.title == kind) {
            Some(plane) => plane.marks.extend(marks),
            None => planes.push(Plane { title: kind, unit: "m".to_owned(), marks }),
        }
    }
    planes.retain(|plane| plane.marks.iter().any(|mark| !mark.points.is_empty()));
    planes
}

fn marks(run: &Run, dataset: &Dataset) -> Vec<Mark> {
    let way = run.protocol.direction().unwrap_or_default();
    let hue = Hue::of_words(way);
    let mut marks = Vec::new();
    if let Some(log) = run.poses.as_ref().filter(|log| !log.poses.is_empty()) {
        let every = log.poses.len().div_ceil(MOST_POINTS);
        let points = log.poses.iter().step_by(every).map(|pose| [pose.x, pose.y]).collect();
        marks.push(Mark::new(hue, true, Shape::Line, &format!("surveyed way {way}"), points));
    }
    let end = run.end.map(|end| [end.x, end.y]);
    marks.push(Mark::new(hue, false, Shape::Dots, &format!("surveyed end {way}"), end.into_iter().collect()));
    let believed = dataset.campaign.odometry.and_then(|odometry| run.dead_reckoned_end(&odometry));
    let believed = believed.map(|pose| [pose.x, pose.y]);
    marks.push(Mark::new(Hue::Ink, true, Shape::Crosses, "dead-reckoned end", believed.into_iter().collect()));
    marks.retain(|mark| !mark.points.is_empty());
    marks
}
