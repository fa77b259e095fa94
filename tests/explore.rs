use hapdef::budget::*; use hapdef::limb::*; use hapdef::project::*; use hapdef::design::*; use std::sync::Arc; use std::time::Instant;
#[test] fn explore() {
    let q = match std::env::var("Q").as_deref() { Ok("standard") => Quality::Standard, _ => Quality::Draft };
    let (mesh, boxes) = LimbSpec::default().build().unwrap();
    let mut p = Project::around("limb.glb", None);
    p.sites.lattice = Lattice::Unrolled;
    p.gauge.signal = match std::env::var("S").as_deref() { Ok("strain") => hapdef::dataset::Signal::Strain, _ => hapdef::dataset::Signal::Displacement };
    p.supports = boxes.iter().map(|&b| SupportKeys{kind: SupportKind::Clamped, box_mm: b, normal: Default::default()}).collect();
    p.evaluation.regions.push(RegionKeys{name:"z 12-108".into(), box_mm: [[-80.,-80.,12.],[80.,80.,108.]]});
    let inputs = Inputs{project:p, part: Arc::new(mesh), painted: None};
    let start = Instant::now();
    let clock = || start.elapsed().as_secs_f64();
    let mut b = q.budget(); if let Ok(r)=std::env::var("R") { b.refinements = r.parse().unwrap(); }
    let d = run(&inputs, &hapdef::placement::SelectorKind::ALL, &b, &clock, &unwatched).unwrap();
    println!("sites {} feasible {} taken {:?}", d.simulated.dataset.sites.len(), d.reduced.feasible.len(), d.feasibility.taken());
    println!("candidates {} curve {:?}", d.reduced.sites.len(), d.reduced.candidates.curve);
    println!("{:?} {:?}", d.seconds, d.work());
    let s = &d.simulated.dataset.sites; let mx = s.iter().map(|s| s.peak_strain).fold(0.0,f64::max); let mn = s.iter().map(|s| s.rms_strain).fold(1.0,f64::min);
    println!("peak {mx:e} min rms {mn:e} rank {} pivot {:e}", d.reduced.pca.rank(), d.simulated.smallest_pivot);
    for r in &d.evaluation.rows { println!("{:15} {:4} {:12} {:7.3} {:7.3} {:7.3}  {:?} {}", r.selector, r.sensors, r.region, r.error_mm, r.median_mm, r.p95_mm, r.hyper, r.converged); }
    println!("{:?}", d.notes());
}
