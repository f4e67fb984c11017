//! The first example of each README, in a program that added that crate alone; and the vehicle of the page for people with a vehicle of their own.
//!
//! The program is made as its reader makes it: `cargo new`, `cargo add`, paste, `cargo run`. What it gets is the archive that would be
//! published, from a folder that stands for the registry. So it shows an example that does not compile, a crate whose signatures need
//! a second one, a feature that one forgot to ask for because a neighbour does, and a file that is in no archive.

use crate::repository::{Failure, Library, Repository, run as run_program};
use std::fs;
use std::path::{Path, PathBuf};

/// Libraries that nobody adds by themselves: the macros come with the bus, the others belong to the program.
const NOT_ALONE: &[&str] = &["stampfly-bus-macros", "stampfly-host"];

/// The page that says how a vehicle of one's own is made, and its program.
const VEHICLE: (&str, &str) = ("docs/guide/own-vehicle.md", "examples/examples/own_vehicle.rs");

/// Runs them all, from the archives in this folder.
pub fn run(repository: &Repository, archives: &Path, libraries: &[Library]) -> Result<(), Failure> {
    let place = std::env::temp_dir().join(format!("stampfly-first-examples-{}", std::process::id()));
    let outcome = registry(repository, archives, &place, libraries).and_then(|registry| {
        let mut alone = libraries.iter().filter(|library| !NOT_ALONE.contains(&library.name.as_str()));
        alone.try_for_each(|library| first(repository, library, &registry, &place))?;
        vehicle(repository, &registry, &place)
    });
    // Nothing depends on its removal.
    let _ = fs::remove_dir_all(&place);
    outcome
}

/// A folder that stands for the registry: our archives, unpacked, and what they depend on, from cargo's own cache.
fn registry(repository: &Repository, archives: &Path, place: &Path, libraries: &[Library]) -> Result<PathBuf, Failure> {
    let folder = place.join("registry");
    let everything = place.join("everything");
    write(&everything.join("src/lib.rs"), "")?;
    let mut manifest = String::from("[package]\nname = \"everything\"\nedition = \"2024\"\n\n[workspace]\n\n");
    let (mut dependencies, mut patches) = (String::from("[dependencies]\n"), String::from("\n[patch.crates-io]\n"));
    for library in libraries {
        let (name, archive) = (&library.name, archive(archives, library)?);
        fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        run_program(repository.command("tar").arg("-xzf").arg(&archive.path).arg("-C").arg(&folder))?;
        let unpacked = folder.join(&archive.name);
        // Nothing to compare with: the archive is the only copy there is.
        write(&unpacked.join(".cargo-checksum.json"), r#"{"files":{}}"#)?;
        dependencies += &format!("{name} = \"*\"\n");
        patches += &format!("{name} = {{ path = {unpacked:?} }}\n");
    }
    manifest += &dependencies;
    manifest += &patches;
    write(&everything.join("Cargo.toml"), &manifest)?;
    // The same versions as in the workspace; cargo strikes out what is not needed.
    fs::copy(repository.root.join("Cargo.lock"), everything.join("Cargo.lock"))
        .map_err(|e| format!("Cargo.lock: {e}"))?;
    let mut vendor = repository.cargo();
    vendor.current_dir(&everything).args(["vendor", "--quiet", "--versioned-dirs", "--no-delete"]).arg(&folder);
    run_program(vendor.stdout(std::process::Stdio::null()))?;
    Ok(folder)
}

struct Archive {
    path: PathBuf,
    /// With its version, as the folder inside is called.
    name: String,
}

fn archive(archives: &Path, library: &Library) -> Result<Archive, Failure> {
    let entries = fs::read_dir(archives).map_err(|e| format!("{}: {e}", archives.display()))?;
    let mut archives = entries.flatten().filter_map(|entry| {
        let path = entry.path();
        let name = path.file_name()?.to_str()?.strip_suffix(".crate")?.to_owned();
        library.is_called(&name).then_some(Archive { path, name })
    });
    archives.next().ok_or_else(|| format!("`{}` has no archive", library.name))
}

fn first(repository: &Repository, library: &Library, registry: &Path, place: &Path) -> Result<(), Failure> {
    let name = library.name.as_str();
    let readme = repository.root.join(&library.folder).join("README.md");
    let text = read(&readme)?;
    let example =
        first_example(&text).ok_or_else(|| format!("{} has no example with a `fn main`", readme.display()))?;
    eprintln!("first example of {name}");
    program(repository, registry, &place.join(name), &example, &[vec!["add", name]])
}

/// The program of the page, with the crates that the page says to add.
fn vehicle(repository: &Repository, registry: &Path, place: &Path) -> Result<(), Failure> {
    let (page, source) = VEHICLE;
    let (text, source) = (read(&repository.root.join(page))?, read(&repository.root.join(source))?);
    let additions = additions(&text);
    if additions.is_empty() {
        return Err(format!("{page} adds no crate"));
    }
    eprintln!("the program of {page}");
    program(repository, registry, &place.join("vehicle"), &source, &additions)
}

/// Makes a program of this source, after these calls of cargo, and runs it.
fn program(
    repository: &Repository,
    registry: &Path,
    folder: &Path,
    main: &str,
    additions: &[Vec<&str>],
) -> Result<(), Failure> {
    let source = "[source.crates-io]\nreplace-with = \"here\"\n\n[source.here]\n";
    write(&folder.join(".cargo/config.toml"), &format!("{source}directory = {registry:?}\n"))?;
    write(&folder.join("Cargo.toml"), "[package]\nname = \"first-example\"\nedition = \"2024\"\n\n[workspace]\n")?;
    write(&folder.join("src/main.rs"), main)?;
    let cargo = |arguments: &[&str]| {
        let mut cargo = repository.cargo();
        cargo.current_dir(folder).env("CARGO_PROFILE_DEV_DEBUG", "false").arg("--quiet").args(arguments);
        cargo
    };
    for addition in additions {
        run_program(&mut cargo(addition))?;
    }
    run_program(cargo(&["run", "--target-dir"]).arg(repository.target("first-examples")))
}

/// The calls of `cargo add` that a page says to make.
fn additions(page: &str) -> Vec<Vec<&str>> {
    let commands = page.lines().filter_map(|line| line.strip_prefix("$ cargo "));
    commands.filter(|command| command.starts_with("add ")).map(|command| command.split_whitespace().collect()).collect()
}

/// The first Rust block of a page, if it is a program.
fn first_example(page: &str) -> Option<String> {
    let (_, rest) = page.split_once("\n```rust\n")?;
    let (code, _) = rest.split_once("\n```")?;
    code.contains("fn main()").then(|| format!("{code}\n"))
}

fn read(path: &Path) -> Result<String, Failure> {
    fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))
}

fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let io = |e: std::io::Error| format!("{}: {e}", path.display());
    fs::create_dir_all(path.parent().unwrap_or(path)).map_err(io)?;
    fs::write(path, text).map_err(io)
}

#[cfg(test)]
mod tests {
    use super::{additions, first_example};

    #[test]
    fn only_a_whole_program_is_an_example() {
        let page = "# A\n\n```toml\nx = 1\n```\n\n```rust\nfn main() {}\n```\n\n```rust\nfn main() { panic!() }\n```\n";
        assert_eq!(first_example(page).as_deref(), Some("fn main() {}\n"));
        assert_eq!(first_example("# A\n\n```rust\nassert!(true);\n```\n"), None);
        assert_eq!(first_example("# A\n"), None);
    }
    #[test]
    fn a_page_says_which_crates_to_add() {
        let page = "```console\n$ cargo new robot\n$ cargo add a b\n$ cargo add c --features d\n$ cargo run\n```\n";
        assert_eq!(additions(page), [vec!["add", "a", "b"], vec!["add", "c", "--features", "d"]]);
    }
}
