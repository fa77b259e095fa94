use super::*;

#[test]
fn what_answers_a_project_can_be_asked_of_it() {
    let project = Project::around("a.stl", None);
    let mut settings = vec![
        TradeSetting::centre(&project),
        TradeSetting::fine(&project),
        TradeSetting::named(&project, Quality::Draft),
    ];
    for k in 0..2 {
        let around: Vec<TradeSetting> = (Knob::ALL.iter())
            .flat_map(|&knob| settings[k].neighbours(knob))
            .collect();
        settings.extend(around);
    }
    let mut answering = 0;
    for setting in settings.iter().filter(|s| s.answers(&project)) {
        let mut applied = project.clone();
        setting.apply(&mut applied);
        assert_eq!(
            setting.budget(&applied),
            applied.budget.budget(),
            "{setting:?}"
        );
        assert!(setting.is_of(&applied));
        applied.check().unwrap();
        answering += 1;
    }
    assert!(answering > 20, "{answering}");
}

#[test]
fn knobs_that_nothing_hears_stay_where_they_are() {
    let project = Project::around("a.stl", None);
    let centre = TradeSetting::centre(&project);
    let offered = |s: &TradeSetting| -> Vec<Knob> {
        let turns = |knob: &Knob| !s.neighbours(*knob).is_empty();
        Knob::ALL.into_iter().filter(turns).collect()
    };
    assert_eq!(
        offered(&centre),
        [
            Knob::Vertices,
            Knob::Touches,
            Knob::AsSolid,
            Knob::Selector,
            Knob::ExpectedPlaces,
            Knob::ExpectedPresses,
            Knob::Signal,
            Knob::Estimator
        ]
    );
    // The paper's way has the knobs of its regressions, and their way back ends where it began.
    let mut paper = project.clone();
    paper.evaluation.estimator = EstimatorKind::Svr;
    paper.selection.selector = SelectorKind::GreedySvr;
    let trained = TradeSetting::centre(&paper);
    for knob in [
        Knob::Unexplained,
        Knob::SelectionTouches,
        Knob::Folds,
        Knob::TuningTouches,
    ] {
        assert!(offered(&trained).contains(&knob), "{knob:?}");
        let turned = trained.neighbours(knob)[0];
        let back = TradeSetting {
            selector: centre.selector,
            estimator: centre.estimator,
            ..turned
        };
        assert_eq!(back.canonical(), centre, "{knob:?}");
    }
    assert!(!centre.in_words().contains("folds") && trained.in_words().contains("folds"));
    // More places than there are touches are no other setting.
    let few = TradeSetting {
        limits: centre.limits.map(|s| Spent { touches: 100, ..s }),
        ..centre
    }
    .canonical();
    assert_eq!(few.neighbours(Knob::ExpectedPlaces).len(), 0);
    assert_eq!(few.neighbours(Knob::Touches).len(), 1);
}

#[test]
fn a_setting_is_judged_by_its_own_estimator() {
    let project = Project::around("a.stl", None);
    let centre = TradeSetting::centre(&project);
    assert_eq!(centre.estimator, EstimatorKind::Matching);
    for setting in [centre, centre.neighbours(Knob::Estimator)[0]] {
        let mut applied = project.clone();
        setting.apply(&mut applied);
        assert_eq!(applied.judging().estimator(), setting.estimator);
    }
    // What nobody uses is left as the project has it.
    let mut applied = project.clone();
    centre.apply(&mut applied);
    assert_eq!(applied.candidates, project.candidates);
    assert_eq!(applied.evaluation, project.evaluation);
    let limits = applied.budget.limits;
    assert_eq!(
        (limits.selection_touches, limits.tuning_touches),
        (None, None)
    );
    // Sites that report displacements are judged by regression, whatever is asked for.
    let shifted = centre.neighbours(Knob::Signal)[0];
    shifted.apply(&mut applied);
    assert_eq!(applied.judging().estimator(), shifted.estimator);
}
