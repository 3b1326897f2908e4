//! The diagnosis: hidden effects are found, clean robots are left alone, intervals hold, bad data say so.

use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use treadmark::dataset::{Dataset, Protocol, Run};
use treadmark::diagnose::{
    DiagnoseError, Diagnosis, Finding, ForwardError, ForwardModel, Library, Options, RunReadings, Study, Verdict,
};
use treadmark::drive::{self, Task};
use treadmark::effect::{Cause, Effect};
use treadmark::experiment::{
    CampaignKind, Challenge, DataKind, EffectsKind, Score, Scorer, Simulator, Tally, campaign,
};
use treadmark::geometry::{Pose2, Trace, wrap_angle};
use treadmark::odometry::OdometryParameters;
use treadmark::scene::{Contact, Doubt, EmpiricalTerm, Feature, Scene, Side, SpottedFloor, TermPart, Tether};

static GO_ON: AtomicBool = AtomicBool::new(false);

pub fn base() -> Scene {
    let mut scene = Scene::load("jnpf_4wd", "lab_floor").expect("shipped");
    scene.time_step = Simulator::TIME_STEP;
    scene
}

fn scored(data: DataKind, seeds: std::ops::Range<u64>) -> Score {
    let effects = EffectsKind::Mixed;
    of(
        Challenge { seed: 0, data, effects, campaign: CampaignKind::Squares, mismatch: false, clean_campaigns: 1 },
        seeds,
    )
}

/// All draws of squares with logs share what was simulated of the model, and of the same robot on other tyres.
fn of(challenge: Challenge, seeds: std::ops::Range<u64>) -> Score {
    static OF_LOGS: OnceLock<Scorer> = OnceLock::new();
    let new = |mismatch: bool| {
        let challenge = Challenge { mismatch, ..challenge };
        Scorer::new(&base(), &challenge, &|_, _| {}, &GO_ON).expect("it can be driven")
    };
    let of_end_points;
    let scorer = match challenge.data {
        DataKind::Logs => OF_LOGS.get_or_init(|| new(true)),
        DataKind::EndPoints => {
            of_end_points = new(challenge.mismatch);
            &of_end_points
        }
    };
    scorer.score(challenge, seeds, &Options::default(), &mut |_| {}, &GO_ON).expect("it can be scored")
}

/// What the extended models gain on another campaign of the same world, over what the truth does.
fn gained(score: &Score) -> f64 {
    let of = |part: usize| score.draws.iter().filter_map(|draw| draw.gain_on_fresh.map(|it| it[part])).sum::<f64>();
    of(0) / of(1)
}

/// Squares that the robot of `world` drives, as one notes them who takes it for `model`.
pub fn squares(world: &Scene, model: &Scene, data: DataKind, seed: u64) -> Dataset {
    let challenge = Challenge {
        seed,
        data,
        effects: EffectsKind::None,
        campaign: CampaignKind::Squares,
        mismatch: false,
        clean_campaigns: 1,
    };
    let mut dataset = challenge.draw(world, &GO_ON).expect("it can be driven").dataset;
    dataset.campaign.odometry = Some(model.robot.odometry);
    dataset
}

/// The runs of 2 m squares.
pub fn small(mut dataset: Dataset) -> Dataset {
    dataset.runs.retain(|run| matches!(run.protocol, Protocol::Square { side, .. } if side < 3.0));
    dataset
}

/// How far the first number of a finding is from the truth \[σ\].
pub fn off(finding: &Finding, truth: f64) -> f64 {
    let parameter = finding.parameters[0];
    (parameter.value - truth) / parameter.std_dev.expect("it was sought")
}

/// As a cause grows, it is nothing first, then suspected with the run that would settle it, then named: the same campaign with
/// the same noise, and a cause larger by a seventh each time.
#[test]
fn a_cause_is_suspected_before_it_is_named() {
    let given = base();
    let (mut stages, mut library) = (Vec::new(), None);
    for step in 0..8 {
        let larger = cause("wheel_diameter_mismatch", 5e-4 * 1.15_f64.powi(step));
        let dataset = small(squares(&larger.edit(&given), &given, DataKind::EndPoints, 5));
        let found = diagnosed_knowing(&given, &dataset, &mut library);
        let stage = match (found.verdict, &found.suspicion, &found.next_experiment) {
            (Verdict::Explained, None, None) => 0,
            (Verdict::Explained, Some(suspicion), Some(next)) => {
                assert!(suspicion.odds > 3.0 && suspicion.odds < 50.0, "{suspicion:?}");
                assert_eq!(next.separates[1], "nothing", "{next:?}");
                1
            }
            (Verdict::Named | Verdict::Ambiguous, None, _) => 2,
            other => panic!("{other:?}"),
        };
        stages.push(stage);
    }
    assert!(stages.is_sorted() && stages.contains(&0) && stages.contains(&1) && stages.contains(&2), "{stages:?}");
}

/// The same of a second cause beside one that is named at any time: a track that is 2 % wider, and wheels that differ more and
/// more.
#[test]
fn a_further_cause_is_suspected_before_it_is_named() {
    let given = base();
    let (mut stages, mut library) = (Vec::new(), None);
    for step in 3..8 {
        let causes = [cause("effective_track", 0.02), cause("wheel_diameter_mismatch", 6e-4 * 1.15_f64.powi(step))];
        let dataset = small(squares(&Cause::edit_all(&causes, &given), &given, DataKind::EndPoints, 5));
        let found = diagnosed_knowing(&given, &dataset, &mut library);
        let stage = match (found.findings.len(), &found.suspicion, &found.next_experiment) {
            (1, None, _) => 0,
            (1, Some(suspicion), Some(next)) => {
                assert!(suspicion.effects.iter().any(|(id, _)| *id == "wheel_diameter_mismatch"), "{suspicion:?}");
                assert!(next.separates[0].starts_with("effective_track and "), "{next:?}");
                assert_eq!(next.separates[1], "effective_track", "{next:?}");
                1
            }
            (2, _, _) => 2,
            other => panic!("{other:?}"),
        };
        stages.push(stage);
        if stage == 2 {
            break;
        }
    }
    assert!(stages.is_sorted() && stages.contains(&0) && stages.contains(&1) && stages.contains(&2), "{stages:?}");
}

/// Hidden effects drawn from the priors, and a clean robot in one draw of five: no wrong name, no false alarm, and names
/// where an oracle that knows the truth could give them. Of so few draws one may be lost to noise (in 12 draws at the
/// targets' rates of 1 to 2 % a draw, two or more would be a matter of 1 in 40). What was found foretells another campaign as
/// well as the truth does, to a tenth.
#[test]
fn hidden_effects_are_found_in_logs() {
    let result = scored(DataKind::Logs, 300..312);
    let lost = result.count(Tally::Wrong) + result.count(Tally::FalseAlarm) + result.count(Tally::Missed);
    assert!(lost <= 1, "{:#?}", result.draws);
    let found = result.count(Tally::Named) + result.count(Tally::RightGroup);
    assert!(found + 1 >= result.oracle_nameable && found > 0, "{:#?}", result.draws);
    assert!(gained(&result) > 0.9, "{:#?}", result.draws);
}

#[test]
fn hidden_effects_are_found_in_end_points() {
    let result = scored(DataKind::EndPoints, 400..424);
    let lost = result.count(Tally::Wrong) + result.count(Tally::FalseAlarm) + result.count(Tally::Missed);
    assert!(lost <= 1, "{:#?}", result.draws);
    let found = result.count(Tally::Named) + result.count(Tally::RightGroup);
    assert!(found + 1 >= result.oracle_nameable && found > 0, "{:#?}", result.draws);
}

/// Something that is not in the catalogue, a tether, a wheel out of round, a carpet, is no effect of the catalogue; a formula
/// in its place gains half of what the truth would.
#[test]
fn what_is_in_no_catalogue_is_not_explained() {
    let outside = Challenge {
        seed: 0,
        data: DataKind::Logs,
        effects: EffectsKind::Outside,
        campaign: CampaignKind::Squares,
        mismatch: false,
        clean_campaigns: 1,
    };
    let result = of(outside, 500..504);
    assert_eq!(result.count(Tally::Wrong) + result.count(Tally::Missed), 0, "{:#?}", result.draws);
    assert!(result.count(Tally::Unexplained) > 0, "{:#?}", result.draws);
    assert!(gained(&result) > 0.5, "{:#?}", result.draws);
}

/// A model that is written down is driven as a whole, causes and formula at once, and has to do so what its parts were fitted to
/// do: of the runs' ends it leaves less than half of what the model as given leaves. (A tether; before causes were simulated
/// together with the formula beside them it left half as much again.)
#[test]
fn causes_beside_a_formula_do_together_what_they_were_fitted_to_do() {
    let tethered = Challenge {
        seed: 54021,
        data: DataKind::Logs,
        effects: EffectsKind::Outside,
        campaign: CampaignKind::Squares,
        mismatch: false,
        clean_campaigns: 1,
    };
    let found = diagnosed(&base(), &tethered.draw(&base(), &GO_ON).expect("it can be driven").dataset);
    assert_eq!(found.verdict, Verdict::Unexplained);
    assert!(!found.causes.is_empty() && !found.empirical.is_empty(), "{:?} {:?}", found.causes, found.empirical);
    let square = |x: f64, y: f64| x * x + y * y;
    let given = found.misfit.conditions.iter().map(|c| square(c.residual[0].expect("x"), c.residual[1].expect("y")));
    let written = found.residues.iter().map(|left| square(*left.x.last().expect("x"), *left.y.last().expect("y")));
    assert_eq!(found.residues.len(), found.misfit.conditions.len());
    let [given, written] = [given.sum::<f64>(), written.sum::<f64>()].map(f64::sqrt);
    assert!(written < 0.5 * given, "{written} of {given} m");
    // What they all leave makes no list of causes.
    let causes: usize = found.causes.len() + found.empirical.len();
    assert!(causes <= 6, "{:?} {:?}", found.causes, found.empirical);
    // And so the answer says: as fitted it leaves what is drawn, and what was written is hardly another.
    let remainder = found.remainder.expect("squares");
    let off = |run: &RunReadings| {
        let (surveyed, fitted) = (run.measured.last().expect("read"), run.after.last().expect("read"));
        square(surveyed.x - fitted.x, surveyed.y - fitted.y)
    };
    let drawn = (found.runs.iter().map(off).sum::<f64>() / found.runs.len() as f64).sqrt();
    assert!((remainder.fitted / drawn - 1.0).abs() < 1e-6, "{remainder:?} {drawn}");
    assert!(!remainder.is_other(), "{remainder:?}");
}

/// Floors that carry the robot, in proportion to one feature of its motion: sideways as it turns, which several causes of the
/// catalogue together mimic to within the noise, round the faster the farther out it is, which no cause does and other tyres do
/// better than the model's, round the faster the longer it drives, by whole turns in the end, which is forty times what is
/// expected of a term, and, as a grain does, to the left along the room and to the right across it, of which little is left by
/// the end of a square. And something pulls it, the harder the farther out it is. Neither is an answer where one term of a formula is.
#[test]
fn neither_a_list_of_causes_nor_other_tyres_are_an_answer_where_one_term_is() {
    let sideways = EmpiricalTerm { part: TermPart::Left, feature: Feature::AbsYawRate, coefficient: -0.0056 };
    let round = EmpiricalTerm { part: TermPart::Yaw, feature: Feature::SpeedX, coefficient: -0.0107 };
    let faster = EmpiricalTerm { part: TermPart::Yaw, feature: Feature::SpeedTime, coefficient: -0.012 };
    let grain = EmpiricalTerm { part: TermPart::Yaw, feature: Feature::SpeedCosTwiceHeading, coefficient: 0.01 };
    let pulled = EmpiricalTerm { part: TermPart::Potential, feature: Feature::XY, coefficient: 1.0 };
    for carried in [sideways, round, faster, grain, pulled] {
        let mut world = base();
        world.empirical.push(carried);
        let found = diagnosed(&base(), &small(squares(&world, &base(), DataKind::Logs, 3022)));
        assert_eq!(found.verdict, Verdict::Unexplained, "{:#?}", found.ranking);
        assert_eq!(found.other_tyres, None);
        let [term] = found.empirical[..] else { panic!("{:?}", found.empirical) };
        assert_eq!((term.part, term.feature), (carried.part, carried.feature));
        assert!((term.coefficient / carried.coefficient - 1.0).abs() < 0.1, "{term}");
    }
}

/// In a world of other tyres, be they rigid cylinders, the model is extended on a clean campaign and says how far it is in
/// doubt; what is hidden on top is found all the same. Of four draws one may be lost.
#[test]
fn hidden_effects_are_found_on_tyres_that_the_model_does_not_know() {
    let mismatch = Challenge {
        seed: 0,
        data: DataKind::Logs,
        effects: EffectsKind::One,
        campaign: CampaignKind::Squares,
        mismatch: true,
        clean_campaigns: 1,
    };
    let result = of(mismatch, 600..604);
    let lost = result.count(Tally::Wrong) + result.count(Tally::Missed);
    assert!(lost <= 1, "{:#?}", result.draws);
    assert!(result.count(Tally::Named) + result.count(Tally::RightGroup) > 0, "{:#?}", result.draws);
}

/// A model that is in doubt blames no cause for what lies within the doubt; one that is sure does.
#[test]
fn a_model_in_doubt_blames_nothing_for_so_little() {
    let cause = Cause { values: vec![0.006], ..Effect::named("effective_track").expect("known").nothing() };
    let given = base();
    let dataset = squares(&cause.edit(&given), &given, DataKind::EndPoints, 9);
    let mut library = None;
    let mut verdict = |doubt: Doubt| {
        let mut scene = given.clone();
        scene.robot.doubt = doubt;
        diagnosed_knowing(&scene, &dataset, &mut library).verdict
    };
    // On closed squares a track and a scale are hardly told apart; one of them it is.
    assert!(matches!(verdict(Doubt::default()), Verdict::Named | Verdict::Ambiguous));
    assert_eq!(verdict(Doubt { effective_track: 0.02, ..Doubt::default() }), Verdict::Explained);
    assert_eq!(verdict(Doubt { motion: 0.006, ..Doubt::default() }), Verdict::Explained);
}

/// Lets a robot head to the left of where it went and to the right by turns, twice a run, by up to `most` \[rad\].
fn sway(run: &mut Run, most: f64) {
    let log = run.poses.as_mut().expect("logs");
    let last = log.poses.len() - 1;
    let (mut before, mut off) = (log.poses[0], [0.0; 2]);
    for (row, pose) in log.poses.iter_mut().enumerate() {
        let turned = most * (2.0 * std::f64::consts::TAU * row as f64 / last as f64).sin();
        let [east, north] = [pose.x - before.x, pose.y - before.y];
        before = *pose;
        off[0] += turned.cos() * east - turned.sin() * north - east;
        off[1] += turned.sin() * east + turned.cos() * north - north;
        pose.x += off[0];
        pose.y += off[1];
        pose.heading = pose.heading.map(|heading| heading + turned);
    }
    let end = run.end.as_mut().expect("surveyed");
    end.x += off[0];
    end.y += off[1];
}

/// What a robot makes good again by the end of a run is no cause. A model that is sure of itself cannot explain it, and is told
/// how it may be in doubt; with that, what is hidden beside it is found alone and as large as it is.
#[test]
fn errors_that_are_made_good_are_no_causes_where_the_model_says_so() {
    let given = base();
    let mut dataset = small(squares(&cause("effective_track", 0.02).edit(&given), &given, DataKind::Logs, 12));
    for run in &mut dataset.runs {
        sway(run, 0.006);
    }
    let mut library = None;
    let mut under = |doubt: Doubt| {
        let mut scene = given.clone();
        scene.robot.doubt = doubt;
        diagnosed_knowing(&scene, &dataset, &mut library)
    };
    let sure = under(Doubt::default());
    assert_eq!(sure.verdict, Verdict::Unexplained, "{:#?}", sure.ranking);
    let told = sure.transient.expect("it leaves much");
    let found = under(Doubt { transient: told.share, ..Doubt::default() });
    assert_eq!(names(&found), ["effective_track"], "{:#?}", found.ranking);
    assert!(off(&found.findings[0], 0.02).abs() < 3.0, "{:?}", found.findings);
    assert!(found.empirical.is_empty(), "{:?}", found.empirical);
}

/// What a campaign left of the model, the next one leaves again: in a world with a tether that no cause explains, a second
/// campaign has nothing new, and a floor that was tilted since is named alone.
#[test]
fn the_next_campaign_is_held_against_what_the_last_one_left() {
    let tethered = Tethered::new(31, |world, seed| small(squares(world, &base(), DataKind::EndPoints, seed)));
    let next = tethered.next(&tethered.world);
    assert_eq!(next.verdict, Verdict::Explained, "{:#?}", next.ranking);
    let floor = Cause { values: vec![0.008, 1.0], ..Effect::named("floor_slope").expect("known").nothing() };
    let tilted = tethered.next(&floor.edit(&tethered.world));
    assert_eq!(names(&tilted), ["floor_slope"], "{:#?}", tilted.ranking);
}

/// What was left belongs to places: poses that are stamped late since then are held against what was left where the robot was,
/// and nothing but the clocks is named.
#[test]
fn clocks_that_disagree_move_where_the_last_campaign_is_remembered() {
    let clocks = Cause { values: vec![0.2, 0.0, 0.0], ..Effect::named("survey_time_offset").expect("known").nothing() };
    for seed in [31, 41, 51] {
        let tethered = Tethered::new(seed, |world, seed| small(squares(world, &base(), DataKind::Logs, seed)));
        let late = tethered.next(&clocks.edit(&tethered.world));
        assert_eq!(names(&late), ["survey_time_offset"], "{seed}: {:#?}", late.ranking);
    }
}

/// What runs stray by is told by readings of where they were, by the clocks as they are found: corners that come a few milliseconds
/// sooner or later are no noise of headings, which would hide a start that is turned by little.
#[test]
fn what_runs_stray_by_is_told_by_their_clocks() {
    let clocks =
        Cause { values: vec![-0.2, 0.0, 0.0], ..Effect::named("survey_time_offset").expect("known").nothing() };
    let world = Cause::edit_all(&[clocks, cause("start_heading_error", -0.006)], &base());
    let found = diagnosed(&base(), &squares(&world, &base(), DataKind::Logs, 12));
    let told = found.noise.heading_std;
    assert!((told / world.survey.heading_std).ln().abs() < 0.2, "{told} rad of {}", world.survey.heading_std);
    assert_eq!(names(&found), ["start_heading_error", "survey_time_offset"], "{:#?}", found.ranking);
    assert!(off(&found.findings[0], -0.006).abs() < 3.0, "{:#?}", found.findings);
}

/// What tyres lose is counted from the beginning of a campaign, also where the first of these runs come an hour after it; and what
/// repeated runs differ by on such tyres is no scatter.
#[test]
fn tyres_that_shrink_are_timed_and_are_no_scatter() {
    let shrinks = cause("tyre_radius_drift", -0.02);
    let world = shrinks.edit(&base());
    let late = |task: Task| Task { started: task.started.map(|started| started + 3600.0), ..task };
    let drive = |task| {
        let measured = drive::run(&world, &late(task), 5, None, &GO_ON).expect("it can be driven").measured;
        Run { encoders: None, poses: None, ..measured }
    };
    let runs = CampaignKind::Squares.tasks(&world).into_iter().map(drive).collect();
    let found = diagnosed(&base(), &small(Dataset { campaign: campaign(&world, "late"), runs }));
    assert_eq!(names(&found), ["tyre_radius_drift"], "{:#?}", found.ranking);
    assert!(off(&found.findings[0], -0.02).abs() < 3.0, "{:#?}", found.findings);
    // Ten runs tell the scatter to a fifth or so.
    let driven = world.scatter.heading_per_corner;
    let learnt = found.noise.scatter.heading_per_corner;
    assert!(learnt < 1.5 * driven, "{learnt} rad a corner of {driven}");
}

/// Effects that are named, each alone.
pub fn names(diagnosis: &Diagnosis) -> Vec<&'static str> {
    assert_eq!(diagnosis.verdict, Verdict::Named, "{:#?}", diagnosis.ranking);
    diagnosis.findings.iter().map(|finding| finding.effect).collect()
}

/// A robot on a tether, which is in no catalogue, and a model that was extended on a campaign of it.
struct Tethered {
    world: Scene,
    model: Scene,
    seed: u64,
    campaign: fn(&Scene, u64) -> Dataset,
}

impl Tethered {
    fn new(seed: u64, campaign: fn(&Scene, u64) -> Dataset) -> Tethered {
        let mut world = base();
        world.tether = Some(Tether { anchor: [-2.0, 3.0, 1.0], pull: 8.0 });
        // Whether other tyres would do better is not the question here, and takes long.
        let options = Options { other_tyres: false, ..Options::default() };
        let last = diagnosed_under(options, &base(), &campaign(&world, seed), &mut None);
        assert_ne!(last.verdict, Verdict::Explained, "{:#?}", last.ranking);
        let mut model = Cause::edit_all(&last.causes, &base());
        model.empirical.extend(&last.empirical);
        model.robot.residues = last.residues;
        Tethered { world, model, seed, campaign }
    }

    /// What the model says of another campaign, in this world.
    fn next(&self, world: &Scene) -> Diagnosis {
        diagnosed(&self.model, &(self.campaign)(world, self.seed + 1))
    }
}

/// What a model says of a dataset.
pub fn diagnosed(model: &Scene, dataset: &Dataset) -> Diagnosis {
    diagnosed_together(model, std::slice::from_ref(dataset))
}

/// The same by responses of its runs that are known, or are from now on.
pub fn diagnosed_knowing(model: &Scene, dataset: &Dataset, library: &mut Option<Library>) -> Diagnosis {
    diagnosed_under(Options::default(), model, dataset, library)
}

/// The same under other options.
fn diagnosed_under(options: Options, model: &Scene, dataset: &Dataset, library: &mut Option<Library>) -> Diagnosis {
    let simulator = Simulator::new(model, &GO_ON);
    let data = std::slice::from_ref(dataset);
    let study = Study::new(data, &[], &simulator, options, library.as_ref(), &|_, _| {});
    let mut study = study.expect("it is data");
    library.get_or_insert_with(|| study.library());
    study.diagnose().expect("it can be diagnosed")
}

/// What a model says of several.
pub fn diagnosed_together(model: &Scene, datasets: &[Dataset]) -> Diagnosis {
    let simulator = Simulator::new(model, &GO_ON);
    let mut study = Study::new(datasets, &[], &simulator, Options::default(), None, &|_, _| {}).expect("it is data");
    study.diagnose().expect("it can be diagnosed")
}

/// A cause with one number.
pub fn cause(id: &str, value: f64) -> Cause {
    Cause { values: vec![value], ..Effect::named(id).expect("known").nothing() }
}

/// A model that was made right for the wrong reason: the robot is a fifth shorter than believed, and friction was blamed for
/// its narrower effective track.
struct Moved {
    model: Scene,
    /// The robot as it is.
    world: Scene,
}

impl Moved {
    fn new() -> Moved {
        let given = base();
        let mut world = given.clone();
        for wheel in &mut world.robot.wheels {
            wheel.base_from_wheel.translation.x *= 0.8;
        }
        // b + l²/b on level ground and isotropic friction.
        let [believed, actual] = [&given, &world].map(|scene| {
            let (b, l) = (scene.robot.track_width(), scene.robot.wheelbase());
            b + l * l / b
        });
        Moved { model: cause("effective_track", actual / believed - 1.0).edit(&given), world }
    }

    /// Squares of 2 m with logs of the robot with these causes, and nothing else, at work.
    fn drive(&self, causes: &[Cause]) -> Dataset {
        small(squares(&Cause::edit_all(causes, &self.world), &self.model, DataKind::Logs, 42))
    }

    /// How far it was moved, as it would say itself.
    fn in_doubt() -> Doubt {
        Doubt { response: 0.2, effective_track: 0.01, ..Doubt::default() }.of_usual_tyres()
    }

    /// What the model finds if it is in each such doubt.
    fn findings<const N: usize>(&self, dataset: &Dataset, doubts: [Doubt; N]) -> [Vec<Finding>; N] {
        let mut library = None;
        doubts.map(|doubt| {
            let mut model = self.model.clone();
            model.robot.doubt = doubt;
            diagnosed_knowing(&model, dataset, &mut library).findings
        })
    }
}

/// A moved model answers causes otherwise: a load turns the robot about another point than it says. One that states how far it
/// was moved finds the load and names nothing beside it; one that is sure does not.
#[test]
fn a_model_that_was_moved_finds_causes_that_act_otherwise() {
    const LOAD: f64 = -0.015;
    let moved = Moved::new();
    let dataset = moved.drive(&[cause("load_offset_longitudinal", LOAD)]);
    let [in_doubt, sure] = moved.findings(&dataset, [Moved::in_doubt(), Doubt::default()]);
    assert_eq!(in_doubt.len(), 1, "{in_doubt:#?}");
    assert_eq!(in_doubt[0].effect, "load_offset_longitudinal");
    assert!(off(&in_doubt[0], LOAD).abs() < 3.0, "{in_doubt:#?}");
    assert!(sure.len() > 1 || sure.iter().any(|finding| off(finding, LOAD).abs() > 3.0), "{sure:#?}");
}

/// A moved model does not know where the centre of rotation goes under a cause: unequal wheels that move it by 8 mm, as they
/// do where wheels are hard and roll on their edges, are not a tracked point that is 8 mm off. A point that is off without any
/// other cause is found all the same.
#[test]
fn a_model_that_was_moved_does_not_know_where_a_cause_moves_the_centre_of_rotation() {
    let moved = Moved::new();
    let centre = |y: f64| {
        let effect = Effect::named("survey_lever_arm").expect("known");
        Cause { values: vec![0.0, y], ..effect.nothing() }
    };
    let unequal = moved.drive(&[cause("wheel_diameter_mismatch", 0.006), centre(-0.008)]);
    let names = |findings: &[Finding]| findings.iter().map(|finding| finding.effect).collect::<Vec<_>>();
    let [in_doubt, sure] = moved.findings(&unequal, [Moved::in_doubt(), Doubt::default()]);
    assert_eq!(names(&in_doubt), ["wheel_diameter_mismatch"], "{in_doubt:#?}");
    assert!(names(&sure).contains(&"survey_lever_arm"), "{sure:#?}");
    let [off] = moved.findings(&moved.drive(&[centre(-0.04)]), [Moved::in_doubt()]);
    assert_eq!(names(&off), ["survey_lever_arm"], "{off:#?}");
    assert!(off[0].confounded_with.is_empty(), "{off:#?}");
}

/// A load ahead of the middle and one behind it widen the track much alike: a search that only goes down from the middle ends on
/// one side, whichever is true, or blames the track. To 4 σ of the intervals that are stated.
#[test]
fn a_load_is_found_on_the_side_that_it_is_on() {
    let given = base();
    let mut library = None;
    for load in [-0.025, 0.025] {
        let world = cause("load_offset_longitudinal", load).edit(&given);
        let dataset = small(squares(&world, &given, DataKind::EndPoints, 44));
        let found = diagnosed_knowing(&given, &dataset, &mut library);
        let finding = found.findings.first().expect("it is something");
        assert_eq!(finding.effect, "load_offset_longitudinal", "{:#?}", found.ranking);
        assert!(off(finding, load).abs() < 4.0, "{finding:?}, off by {:.1} σ", off(finding, load));
    }
}

/// A robot that nobody has calibrated may have tyres that differ by ten times what is plausible of tyres, and carry its load
/// anywhere. A normal law forbids that: under it, half of the tyres' difference and two toed wheels were found in its place. And
/// what a large load does is no parabola through what a small one does: 1 cm aft the robot turns 1 % farther than without it, 5 cm
/// aft 37 %, 8 cm aft 45 %; aside, it turns by itself. Another track and a lever arm were found in its place.
#[test]
fn causes_that_are_far_larger_than_plausible_are_named() {
    let given = base();
    let mut library = None;
    for (effect, size) in
        [("wheel_diameter_mismatch", 0.05), ("load_offset_longitudinal", -0.08), ("load_offset_lateral", 0.06)]
    {
        let world = cause(effect, size).edit(&given);
        let dataset = small(squares(&world, &given, DataKind::EndPoints, 46));
        let found = diagnosed_knowing(&given, &dataset, &mut library).findings;
        let effects: Vec<&str> = found.iter().map(|finding| finding.effect).collect();
        assert_eq!(effects, [effect], "{found:#?}");
        assert!(off(&found[0], size).abs() < 3.0, "{found:#?}");
    }
}

/// What a controller makes of counts that are later than a tenth of a second goes up and down: it turns a square by 5.982 rad at
/// 0.10 s, by 5.970 at 0.12, by 5.976 at 0.135 and by 5.947 at 0.145. A fit that came from 0 stopped at 0.09 s, and another track or
/// other wheels were found beside, or in its place. To 3 σ of the intervals that are stated.
#[test]
fn counts_that_are_later_than_a_curve_knows_are_all_that_is_wrong() {
    let given = base();
    let (mut library, mut sure) = (None, 0);
    for (seed, delay) in (51..).zip([0.125, 0.135, 0.145]) {
        let world = cause("encoder_latency", delay).edit(&given);
        let dataset = squares(&world, &given, DataKind::EndPoints, seed);
        let found = diagnosed_knowing(&given, &dataset, &mut library).findings;
        let [finding] = found.as_slice() else { panic!("{delay} s: {found:#?}") };
        if finding.effect == "encoder_latency" {
            assert!(off(finding, delay).abs() < 3.0, "{delay} s: {finding:?}");
        } else {
            assert!(finding.confounded_with.contains(&"encoder_latency"), "{delay} s: {finding:?}");
        }
        sure += usize::from(finding.confounded_with.is_empty());
    }
    assert!(sure >= 2, "{sure} of three are sure");
}

/// A model that cannot be driven in some scenes.
struct Fragile<'s> {
    simulator: Simulator<'s>,
    tips: fn(&Scene) -> bool,
    refused: AtomicUsize,
}

/// On a slope with unequal tyres, though with either: another robot would tip over.
fn sloping_and_unequal(scene: &Scene) -> bool {
    let radius = |side: Side| scene.robot.wheels.iter().find(|wheel| wheel.side == side).map(|it| it.tyre.free_radius);
    let [Some(left), Some(right)] = [Side::Left, Side::Right].map(radius) else { return false };
    scene.floor.gradient > 0.005 && (right / left - 1.0).abs() > 0.003
}

impl ForwardModel for Fragile<'_> {
    fn scene(&self) -> &Scene {
        self.simulator.scene()
    }

    fn trace(&self, scene: &Scene, run: &Run, counted: &OdometryParameters) -> Result<Trace, ForwardError> {
        if (self.tips)(scene) {
            self.refused.fetch_add(1, Ordering::Relaxed);
            return Err(ForwardError("it tips over".into()));
        }
        self.simulator.trace(scene, run, counted)
    }

    fn traces_on(
        &self,
        scene: &Scene,
        run: &Run,
        counted: &OdometryParameters,
        floors: &[SpottedFloor],
    ) -> Result<Vec<Trace>, ForwardError> {
        self.simulator.traces_on(scene, run, counted, floors)
    }
}

/// Causes that explain the data and that the model cannot be driven with, together, are no end of a diagnosis: the answer holds
/// one of them as it is, and can be driven. So it is where tyres are in doubt.
#[test]
fn causes_that_cannot_be_driven_together_are_no_answer() {
    let slope = Cause { values: vec![0.01, 1.0], ..Effect::named("floor_slope").expect("known").nothing() };
    let world = Cause::edit_all(&[slope, cause("wheel_diameter_mismatch", 0.005)], &base());
    let dataset = small(squares(&world, &base(), DataKind::EndPoints, 48));
    let mut given = base();
    given.robot.doubt = Doubt::default().of_usual_tyres();
    let simulator = Simulator::new(&given, &GO_ON);
    let model = Fragile { simulator, tips: sloping_and_unequal, refused: AtomicUsize::new(0) };
    let mut study = Study::new(&[dataset], &[], &model, Options::default(), None, &|_, _| {}).expect("it is data");
    let found = study.diagnose().expect("it can be diagnosed");
    assert!(model.refused.load(Ordering::Relaxed) > 0, "{:#?}", found.ranking);
    assert!(!sloping_and_unequal(&Cause::edit_all(&found.causes, &given)), "{:#?}", found.causes);
    let one = |id: &str| found.findings.iter().any(|finding| finding.effect == id);
    assert!(one("floor_slope") || one("wheel_diameter_mismatch"), "{:#?}", found.ranking);
}

/// A cause that tips the robot by itself is none of its causes, and no end of a diagnosis either: the others are weighed, and the
/// reader is told which was not.
#[test]
fn a_cause_that_cannot_be_driven_is_left_out() {
    let world = Cause::edit_all(&[cause("wheel_diameter_mismatch", 0.005)], &base());
    let dataset = small(squares(&world, &base(), DataKind::EndPoints, 48));
    let given = base();
    let simulator = Simulator::new(&given, &GO_ON);
    let leans: fn(&Scene) -> bool = |scene| scene.robot.chassis.centre_of_mass.y.abs() > 1e-4;
    let model = Fragile { simulator, tips: leans, refused: AtomicUsize::new(0) };
    let mut study = Study::new(&[dataset], &[], &model, Options::default(), None, &|_, _| {}).expect("it is data");
    let found = study.diagnose().expect("it can be diagnosed");
    assert!(found.findings.iter().any(|finding| finding.effect == "wheel_diameter_mismatch"), "{:#?}", found.ranking);
    assert_eq!(found.left_out, ["the cause load_offset_lateral: with it, it tips over"]);
    assert!(found.blind_to.iter().all(|blind| blind.effect != "load_offset_lateral"));
}

/// A spot moves the end of a square otherwise from one few centimetres to the next, and turns about as its grip falls: at a corner
/// 0.75 of the grip takes the robot one way and 0.65 the other. End points of squares tell on which leg of which corner it is and
/// how far along, to 0.1 m, and its grip to 3 σ. The third is on the straight of a 4 m square, which does not feel it, while 2 m
/// squares turn beside it. Logs tell the place to a centimetre, by which runs stray from the one that stands for them, along a
/// ridge, for a spot of a little less grip does nearly the same a little farther on, which has to be followed to its top. Since
/// the answer knows how otherwise runs come upon the spot that stray so far, its grip is within 3 σ there, too, and within 0.03: a
/// centimetre is that much of grip along the ridge. Where no square of another size or direction comes upon it, its worth is seen on
/// repeats.
#[test]
fn spots_are_found_where_they_are() {
    let given = base();
    let simulator = Simulator::new(&given, &GO_ON);
    let spot = Effect::named("floor_grip_patch").expect("known");
    let found = |[x, y, ratio]: [f64; 3], kind, seed, library: &mut Option<_>| {
        let world = Cause { values: vec![x, y, 0.3, ratio], ..spot.nothing() }.edit(&given);
        let data = [squares(&world, &given, kind, seed)];
        let mut study =
            Study::new(&data, &[], &simulator, Options::default(), library.as_ref(), &|_, _| {}).expect("it is data");
        library.get_or_insert_with(|| study.library());
        let found = study.diagnose().expect("it can be diagnosed");
        let names: Vec<&str> = found.findings.iter().map(|finding| finding.effect).collect();
        assert_eq!(names, [spot.id], "({x}, {y}): {:#?}", found.ranking);
        let parameters = &found.findings[0].parameters;
        let off = parameters[3].value - ratio;
        let off_sigma = off / parameters[3].std_dev.expect("it was sought");
        // However finely it was looked for, one place is one answer.
        let answers = &found.ranking;
        assert!(answers.iter().all(|one| answers.iter().filter(|other| one.causes == other.causes).count() == 1));
        let away = (parameters[0].value - x).hypot(parameters[1].value - y);
        (study, away, off.abs(), off_sigma.abs())
    };
    let mut library = None;
    for (seed, hidden) in [(3, [2.0, 2.0, 0.65]), (11, [1.9, 2.0, 0.65]), (47, [2.35, 0.0, 0.4])] {
        let (_, away, _, off_sigma) = found(hidden, DataKind::EndPoints, seed, &mut library);
        assert!(away < 0.1 && off_sigma < 3.0, "{hidden:?}: {away:.3} m, {off_sigma:.1} σ");
    }
    for (seed, hidden) in [(5, [2.0, -1.665, 0.415]), (6, [2.0, 1.7, 0.5])] {
        let (mut study, away, off, off_sigma) = found(hidden, DataKind::Logs, seed, &mut None);
        assert!(away < 0.01 && off < 0.03 && off_sigma < 3.0, "{hidden:?}: {away:.4} m, {off:.3}, {off_sigma:.1} σ");
        let gain = study.gain_or_repeats().expect("two sizes of squares");
        let on_repeats = gain.on_repeats.as_deref().unwrap_or(&gain);
        assert!(on_repeats.sure() > 0.3, "{gain:?}");
    }
}

/// A slope is resisted by friction, and no campaign on a level floor shows how much there is: a model that was fitted to one, and
/// says so, gives the slope as widely as that leaves it open. On a floor with 1.2 times the model's friction (1.2 σ of what is
/// in doubt), that covers the slope to 3 σ; a model that is sure of its tyres does not.
#[test]
fn a_model_that_was_fitted_does_not_know_friction() {
    const GRADIENT: f64 = 0.015;
    let given = base();
    let mut floor = given.clone();
    for tyre in floor.robot.wheels.iter_mut().map(|wheel| &mut wheel.tyre) {
        tyre.friction_along *= 1.2;
        tyre.friction_across *= 1.2;
    }
    let slope = Cause { values: vec![GRADIENT, 0.7], ..Effect::named("floor_slope").expect("known").nothing() };
    let dataset = small(squares(&slope.edit(&floor), &given, DataKind::Logs, 45));
    let mut library = None;
    let mut off_by = |doubt: Doubt| {
        let mut model = given.clone();
        model.robot.doubt = doubt;
        let found = diagnosed_knowing(&model, &dataset, &mut library).findings;
        let effects: Vec<&str> = found.iter().map(|finding| finding.effect).collect();
        assert_eq!(effects, ["floor_slope"], "{found:#?}");
        off(&found[0], GRADIENT).abs()
    };
    let sure = off_by(Doubt::default());
    let fitted = off_by(Doubt::default().of_usual_tyres());
    assert!(sure > 3.0 && fitted < 3.0, "{sure:.1} σ, {fitted:.1} σ");
}

/// Rigid cylinders turn the robot in a track a fifth narrower than patches do, and under a load they turn it half as much. A
/// model on patches says whose wheels these are, names the class of what makes the track, and finds the load as large as it is
/// on top; one that keeps to its patches cannot. The extended law is in the answer.
#[test]
fn hard_wheels_are_told_from_patches() {
    const LOAD: f64 = -0.015;
    let given = base();
    let hard = Scene { contact: Contact::Rigid, ..base() };
    let dataset = small(squares(&cause("load_offset_longitudinal", LOAD).edit(&hard), &given, DataKind::Logs, 43));
    let mut library = None;
    let mut diagnosed = |other_tyres: bool| {
        let options = Options { other_tyres, most_causes: 3, ..Options::default() };
        diagnosed_under(options, &given, &dataset, &mut library)
    };
    let free = diagnosed(true);
    let other = free.other_tyres.expect("these are no patches");
    assert_eq!(other.contact, Contact::Rigid);
    assert!(other.log_odds > 10.0, "{other:?}");
    let find = |effect: &str| free.findings.iter().find(|finding| finding.effect == effect);
    assert!(free.findings.len() == 2, "{:#?}", free.findings);
    let track = find("effective_track").expect("the track is another").parameters[0].value;
    assert!((-0.25..-0.12).contains(&track), "{track}");
    let load = find("load_offset_longitudinal").expect("it was put there");
    assert!(off(load, LOAD).abs() < 3.0, "{load:#?}");
    let held = diagnosed(false);
    assert!(held.other_tyres.is_none());
    let is_right = |finding: &Finding| finding.effect == "load_offset_longitudinal" && off(finding, LOAD).abs() < 3.0;
    assert!(held.findings.len() != 2 || !held.findings.iter().any(is_right), "{:#?}", held.findings);
}

/// What causes do to other runs of a kind makes room for what the leading ones are simulated to do to these, and is simulated
/// anew where their curve hangs on it. A toed wheel on rigid cylinders turns the robot by 1.6 rad a radian at first and by a third
/// of that at 15 mrad: along the straight line that was left, one toed by 6.5 mrad came out 6 σ off.
#[test]
fn a_cause_that_levels_off_is_found_as_large_as_it_is_by_what_is_known_of_other_runs() {
    let (data, effects) = (DataKind::Logs, EffectsKind::Two);
    let campaign = CampaignKind::Squares;
    let toed = Challenge { seed: 0, data, effects, campaign, mismatch: true, clean_campaigns: 1 };
    let scored = of(toed, 56158..56159);
    let intervals = &scored.draws[0].intervals;
    let toe = intervals.iter().find(|it| it.effect == "wheel_toe").unwrap_or_else(|| panic!("{:#?}", scored.draws));
    assert!(toe.off.abs() < 3.0, "{toe:?}");
}

/// Axles of rigid wheels that fight do next to nothing up to 1 %, and nearly the same from 1.5 % on: there one of them gives. A fit
/// that comes from 0 stopped before, and called for a toed wheel and a lever arm (98103: 1.7 % beside a play of 6 mrad).
#[test]
fn axles_of_hard_wheels_are_found_beyond_where_one_of_them_gives() {
    let (data, effects) = (DataKind::Logs, EffectsKind::Two);
    let campaign = CampaignKind::Squares;
    let fighting = Challenge { seed: 0, data, effects, campaign, mismatch: true, clean_campaigns: 1 };
    let draws = of(fighting, 98103..98104).draws;
    assert!(!matches!(draws[0].tally, Tally::Wrong | Tally::Missed), "{draws:#?}");
    let axles = draws[0].intervals.iter().find(|it| it.effect == "axle_diameter_mismatch");
    assert!(axles.is_some_and(|it| it.off.abs() < 4.0), "{draws:#?}");
}

/// Of two effects, what the data leave is told from what they do not: one toed wheel on a track of another width is much like another
/// one (71018, 71050), what a load does beside a slope is no sum (71112), and tyres that shrink are not made of a scatter of distance
/// that was learnt with them (71019).
#[test]
fn two_effects_are_told_from_others_as_far_as_the_data_tell() {
    let (data, effects) = (DataKind::Logs, EffectsKind::Two);
    let campaign = CampaignKind::Squares;
    let challenge = Challenge { seed: 0, data, effects, campaign, mismatch: false, clean_campaigns: 1 };
    for seed in [71018, 71019, 71050, 71112] {
        let draws = of(challenge, seed..seed + 1).draws;
        assert!(!matches!(draws[0].tally, Tally::Wrong | Tally::Missed), "{draws:#?}");
    }
}

/// What two strong causes do together is not what each does alone: a load 28 mm aft on a track that is 5 % narrower. Both are
/// found as large as they are, to 4 σ of the intervals that are stated (a sum of what each does alone is 25 σ off).
#[test]
fn causes_that_work_together_are_found_as_large_as_they_are() {
    let hidden = [("load_offset_longitudinal", -0.028), ("effective_track", -0.05)];
    are_found_together(&base(), hidden, |world, given| squares(world, given, DataKind::Logs, 41));
}

/// Which axle of hard wheels gives hangs on what else moves the robot: beside unequal wheels axles that differ turn it the other way
/// than alone. For a sum of both, four causes that are not there were likelier (97579, and these 2 m squares).
#[test]
fn axles_of_hard_wheels_are_found_beside_unequal_wheels() {
    let given = Scene { contact: Contact::Rigid, ..base() };
    let hidden = [("wheel_diameter_mismatch", 0.0102), ("axle_diameter_mismatch", -0.0128)];
    are_found_together(&given, hidden, |world, given| small(squares(world, given, DataKind::Logs, 43)));
}

/// Hides two causes in a robot, and asks a campaign of it for them and nothing else, as large as they are.
fn are_found_together(given: &Scene, hidden: [(&str, f64); 2], campaign: impl Fn(&Scene, &Scene) -> Dataset) {
    let causes = hidden.map(|(id, value)| cause(id, value));
    let dataset = campaign(&Cause::edit_all(&causes, given), given);
    let simulator = Simulator::new(given, &GO_ON);
    let mut study = Study::new(&[dataset], &[], &simulator, Options::default(), None, &|_, _| {}).expect("it is data");
    let found = study.diagnose().expect("it can be diagnosed");
    assert_eq!(found.findings.len(), 2, "{:#?}", found.ranking);
    for (id, value) in hidden {
        let finding = found.findings.iter().find(|finding| finding.effect == id).expect("it is found");
        assert!(off(finding, value).abs() < 4.0, "{id}: {finding:?}, off by {:.1} σ", off(finding, value));
    }
}

fn draw(effects: EffectsKind, seed: u64) -> Dataset {
    let challenge = Challenge {
        seed,
        data: DataKind::EndPoints,
        effects,
        campaign: CampaignKind::Squares,
        mismatch: false,
        clean_campaigns: 1,
    };
    challenge.draw(&base(), &GO_ON).expect("it can be driven").dataset
}

/// The extension takes away what it explains, on runs that took no part, and the extended model needs nothing more.
#[test]
fn an_extension_is_worth_what_it_says_and_suffices() {
    let cause = Cause { values: vec![0.03], ..Effect::named("effective_track").expect("known").nothing() };
    let given = base();
    let dataset = squares(&cause.edit(&given), &given, DataKind::EndPoints, 7);
    let simulator = Simulator::new(&given, &GO_ON);
    let mut study = Study::new(std::slice::from_ref(&dataset), &[], &simulator, Options::default(), None, &|_, _| {})
        .expect("it is data");
    let found = study.diagnose().expect("it can be diagnosed");
    assert_eq!(found.verdict, Verdict::Named, "{:#?}", found.ranking);
    assert_eq!(found.findings[0].effect, "effective_track");
    let value = found.findings[0].parameters[0];
    let sigma = value.std_dev.expect("it was sought");
    assert!((value.value - 0.03).abs() < 3.0 * sigma, "{value:?}");
    let gain = study.gain().expect("two sizes of squares");
    assert!(gain.interval[0] > 0.5, "{gain:?}");
    assert!(gain.position_after < 2.0 * gain.noise_floor, "{gain:?}");

    let extended = Cause::edit_all(&found.causes, &given);
    let simulator = Simulator::new(&extended, &GO_ON);
    let mut study = Study::new(&[dataset], &[], &simulator, Options::default(), None, &|_, _| {}).expect("it is data");
    assert_eq!(study.diagnose().expect("it can be diagnosed").verdict, Verdict::Explained);
}

/// What an answer that was found on small squares expects of itself on large ones, which its open parameter makes more than the
/// noise, holds for the robot that it was found on, and is seen not to hold for one whose track has changed since.
#[test]
fn an_answer_is_held_to_its_own_account() {
    let given = base();
    let simulator = Simulator::new(&given, &GO_ON);
    let unequal = cause("wheel_diameter_mismatch", 0.004);
    let of = |causes: &[Cause], seed| squares(&Cause::edit_all(causes, &given), &given, DataKind::EndPoints, seed);
    let large = |mut dataset: Dataset| {
        dataset.runs.retain(|run| matches!(run.protocol, Protocol::Square { side, .. } if side > 3.0));
        dataset
    };
    let known = small(of(std::slice::from_ref(&unequal), 8));
    for (since, holds) in [(0.0, true), (0.02, false)] {
        let later = large(of(&[unequal.clone(), cause("effective_track", since)], 9));
        let study =
            Study::new(std::slice::from_ref(&known), &[later], &simulator, Options::default(), None, &|_, _| {});
        let mut study = study.expect("it is data");
        assert_eq!(study.diagnose().expect("it can be diagnosed").verdict, Verdict::Named);
        let gain = study.gain().expect("some are held out");
        assert!(gain.position_expected > 1.05 * gain.noise_floor, "{gain:?}");
        assert_eq!(gain.surprise().is_none(), holds, "{gain:?}");
    }
}

/// Runs that are held out are no part of the answer: not what they measured, and not where or how they were driven. What it is
/// worth is how far the extended model's ends are from theirs.
#[test]
fn runs_held_out_do_not_change_the_answer_and_judge_it() {
    let of = |seed, campaign| {
        let (data, effects) = (DataKind::EndPoints, EffectsKind::One);
        let challenge = Challenge { seed, data, effects, campaign, mismatch: false, clean_campaigns: 1 };
        challenge.draw(&base(), &GO_ON).expect("it can be driven").dataset
    };
    let (squares, mut more) = (of(11, CampaignKind::Squares), of(12, CampaignKind::Full));
    more.runs.retain(|run| matches!(run.protocol, Protocol::Circle { .. }));
    assert!(!more.runs.is_empty());
    let base = base();
    let simulator = Simulator::new(&base, &GO_ON);
    let diagnosed = |hold_out: &[Dataset]| {
        let squares = std::slice::from_ref(&squares);
        let mut study = Study::new(squares, hold_out, &simulator, Options::default(), None, &|_, _| {}).expect("data");
        let diagnosis = study.diagnose().expect("it can be diagnosed");
        (diagnosis, study.gain().expect("it has two shapes"))
    };
    let ranking = |diagnosis: &Diagnosis| -> Vec<(Vec<String>, u64)> {
        diagnosis.ranking.iter().map(|it| (it.causes.clone(), it.log_evidence.to_bits())).collect()
    };
    let ((alone, _), (with, gain)) = (diagnosed(&[]), diagnosed(&[more]));
    assert_eq!(ranking(&alone), ranking(&with));
    let squares: Vec<f64> = with
        .runs
        .iter()
        .filter(|run| run.held_out)
        .map(|run| {
            let (measured, after) = (run.measured.last().expect("an end"), run.after.last().expect("an end"));
            (measured.x - after.x).powi(2) + (measured.y - after.y).powi(2)
        })
        .collect();
    let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
    assert!((gain.position_after - rms).abs() < 1e-9, "{} is not {rms}", gain.position_after);
}

/// Thin data: one run, no repeats, blank headings. An answer, or that nothing can be told; never a panic.
#[test]
fn thin_data_say_little() {
    let given = base();
    let simulator = Simulator::new(&given, &GO_ON);
    let whole = draw(EffectsKind::None, 3);
    let mut one = whole.clone();
    one.runs.truncate(1);
    let mut blank = whole.clone();
    for run in &mut blank.runs {
        if let Some(end) = &mut run.end {
            end.heading = None;
        }
    }
    for (what, dataset) in [("one run", one), ("blank headings", blank)] {
        let mut study =
            Study::new(&[dataset], &[], &simulator, Options::default(), None, &|_, _| {}).expect("it is data");
        let found = study.diagnose().expect("it can be diagnosed");
        assert_eq!(found.verdict, Verdict::Explained, "{what}: {:?}", found.findings);
        assert!(!found.blind_to.is_empty());
        let _ = study.gain_or_repeats();
    }
    let mut none = whole;
    for run in &mut none.runs {
        run.end = None;
    }
    let refused = Study::new(&[none], &[], &simulator, Options::default(), None, &|_, _| {});
    assert!(matches!(refused, Err(DiagnoseError::NothingToUse { .. })));
}

/// Poses of one run that contradict where it ended, since they are in the frame of the room or since headings were wrapped to one
/// turn, are explained by nothing: where nothing repeats, what is far beyond usual noise is none either. What comes nearest by the
/// stand-in need not be a robot that can be driven, which is no error of the user's.
#[test]
fn poses_that_make_no_sense_are_unexplained() {
    let given = base();
    let whole = small(squares(&given, &given, DataKind::Logs, 3));
    let one_of = |name: &str, noted: &dyn Fn(Pose2) -> Pose2| {
        let mut one = Dataset { runs: whole.runs[..1].to_vec(), ..whole.clone() };
        for pose in &mut one.runs[0].poses.as_mut().expect("it has a log").poses {
            *pose = noted(Pose2::new(pose.x, pose.y, pose.heading.expect("measured"))).into();
        }
        let found = diagnosed_under(Options { most_causes: 2, ..Options::default() }, &given, &one, &mut None);
        assert_eq!(found.verdict, Verdict::Unexplained, "{name}: {:?}", found.findings);
    };
    one_of("room", &|pose| Pose2::new(1.3, 2.4, 0.7).compose(pose));
    one_of("wrapped", &|pose| Pose2::new(pose.x, pose.y, wrap_angle(pose.heading)));
}

/// The same dataset gives the same diagnosis, whatever the threads do.
#[test]
fn a_diagnosis_does_not_depend_on_threads() {
    let given = base();
    let dataset = draw(EffectsKind::One, 8);
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| format!("{:?}", diagnosed(&given, &dataset)))
    };
    assert_eq!(on(1), on(2));
}
