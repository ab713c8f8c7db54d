mod client;
mod mailbox;
mod operations;
mod program;
mod sizes;
use std::path::PathBuf;
fn main() -> anyhow::Result<()> {
    let dir = PathBuf::from(std::env::args().nth(1).unwrap());
    let only = std::env::args().nth(2);
    for name in ["ours", "zencan"] {
        println!("{name}");
        let mut client = operations::operational(program::Program::start(&dir.join(name))?)?;
        for op in &operations::OPERATIONS {
            if only.as_deref().is_none_or(|o| op.name.contains(o)) {
            println!("{:50} {:?} {:?}", op.name, op.measure(&mut client), op.published);
            }
        }
        println!("{:?}", sizes::Sizes::of(&dir.join(name))?.without(sizes::Sizes::of(&dir.join("empty"))?));
    }
    Ok(())
}
