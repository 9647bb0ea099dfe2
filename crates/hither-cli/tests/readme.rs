//! The README's example does what the README says, word for word.

/// The lines between the marks, without their indentation.
fn example_of_this_file() -> String {
    let lines = include_str!("readme.rs").lines().map(str::trim);
    let inside = lines.skip_while(|l| *l != "// begin").skip(1).take_while(|l| *l != "// end");
    inside.map(|line| format!("{line}\n")).collect()
}

#[test]
fn the_example_is_the_readmes() {
    let readme = include_str!("../../../README.md");
    let code = readme.split("```rust\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let code: String = code.lines().filter(|line| !line.is_empty()).map(|line| format!("{line}\n")).collect();
    assert_eq!(code, example_of_this_file());
}

#[test]
fn the_example_works() -> Result<(), Box<dyn std::error::Error>> {
    // begin
    use hither::{IndexOptions, RenderOptions, SceneIndex, render};
    let scene = hither_worlds::generate("office?n=33")?; // or hither_io::read(path)?.scene
    let index = SceneIndex::build(scene, &IndexOptions::default());
    let view = index.scene().view(0, (1280, 720)).expect("the world has cameras");
    let frame = render(&index, &view, &RenderOptions::default())?;
    println!("{:?} at {} m", frame.id(640, 360), frame.distance(640, 360));
    // end
    assert!(frame.id(640, 360).is_some() && frame.distance(640, 360) > 1.0);
    Ok(())
}
