//! What the CPU engine promises beside pictures that agree with the reference.

use crate::scenes::{self, Case, methods};
use splatkit::{cpu::CpuRenderer, scene::Scene};

/// Any number of threads draws the same bytes.
#[test]
fn threads_change_nothing() {
    for make in [
        scenes::marschner_lobb,
        scenes::huge_among_small,
        scenes::surface_in_a_volume,
        methods::body_centred,
    ] {
        let Case { name, scene, camera, settings } = make();
        let with = |threads: usize| {
            let pool =
                rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let draw = || CpuRenderer::new(&scene)?.render(&camera, &settings);
            pool.install(draw).expect(name).0.color
        };
        assert_eq!(with(1), with(3), "{name}");
    }
}

#[test]
fn scenes_without_anything_are_not_drawn() {
    let case = scenes::ellipsoids_in_perspective();
    let mut renderer = CpuRenderer::new(&Scene::new()).unwrap();
    let drawn = renderer.render(&case.camera, &case.settings);
    assert!(matches!(drawn, Err(splatkit::Error::NothingToDraw(_))));
}
