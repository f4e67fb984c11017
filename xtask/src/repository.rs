//! Where the sources are, what the library crates are called, and how a program is run.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use toml_edit::{DocumentMut, Item};

/// Why something failed, in words.
pub type Failure = String;

/// Published libraries for a PC. Every other one has to build for bare metal.
const HOST_ONLY: &[&str] = &["stampfly-bus-macros", "stampfly-ground", "stampfly-host", "stampfly-sim"];

/// The working copy.
pub struct Repository {
    /// Its top folder.
    pub root: PathBuf,
}

/// A library of this repository.
pub struct Library {
    /// Package name.
    pub name: String,
    /// Its folder, from the top.
    pub folder: PathBuf,
    /// Has it to build for bare metal?
    pub bare_metal: bool,
    /// Is it for others? If not, only tests and examples of the repository use it.
    pub published: bool,
    /// Its features, without `default`.
    pub features: Vec<String>,
}

impl Library {
    /// Is this the name of a version of it, as archives are called?
    pub fn is_called(&self, name: &str) -> bool {
        let version = name.strip_prefix(&self.name).and_then(|rest| rest.strip_prefix('-'));
        version.is_some_and(|version| version.starts_with(|first: char| first.is_ascii_digit()))
    }
}

impl Repository {
    /// The one this program was built from.
    pub fn find() -> Self {
        let package = Path::new(env!("CARGO_MANIFEST_DIR"));
        Self { root: package.parent().unwrap_or(package).to_owned() }
    }

    /// A place in cargo's folder for generated files.
    pub fn target(&self, name: &str) -> PathBuf {
        let folder = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| "target".into(), PathBuf::from);
        self.root.join(folder).join(name)
    }

    /// The folder of the recorded flights: where `STAMPFLY_DATA` says, or beside the repository.
    pub fn data(&self) -> Option<PathBuf> {
        let folder = std::env::var_os("STAMPFLY_DATA").map_or_else(|| "../shared/data".into(), PathBuf::from);
        self.root.join(folder).canonicalize().ok().filter(|folder| folder.is_dir())
    }

    /// Every library crate: the members of the workspace that are called `stampfly-*` and have a `src/lib.rs`. A new crate is
    /// checked without being listed anywhere else.
    pub fn libraries(&self) -> Result<Vec<Library>, Failure> {
        let workspace = self.manifest(Path::new(""))?;
        let members = workspace.get("workspace").and_then(|table| table.get("members")).and_then(Item::as_array);
        let members = members.ok_or("Cargo.toml: no members")?.iter().filter_map(|member| member.as_str());
        let mut libraries = Vec::new();
        for folder in members.map(PathBuf::from) {
            let manifest = self.manifest(&folder)?;
            let package = manifest.get("package").ok_or_else(|| format!("{}: no package", folder.display()))?;
            let name = package.get("name").and_then(Item::as_str).unwrap_or_default().to_owned();
            if name.starts_with("stampfly-") && self.root.join(&folder).join("src/lib.rs").exists() {
                let published = package.get("publish").and_then(Item::as_bool).unwrap_or(true);
                let bare_metal = published && !HOST_ONLY.contains(&name.as_str());
                let features = manifest.get("features").and_then(Item::as_table).into_iter().flatten();
                let features = features.map(|(feature, _)| feature.to_owned()).filter(|feature| feature != "default");
                libraries.push(Library { name, folder, bare_metal, published, features: features.collect() });
            }
        }
        libraries.sort_by(|a, b| a.name.cmp(&b.name));
        if libraries.is_empty() { Err(format!("no library in {}", self.root.display())) } else { Ok(libraries) }
    }

    /// The version that all packages of the workspace have.
    pub fn version(&self) -> Result<String, Failure> {
        self.of_all_packages("version")
    }

    /// The oldest Rust that they promise to build with.
    pub fn rust_version(&self) -> Result<String, Failure> {
        self.of_all_packages("rust-version")
    }

    fn of_all_packages(&self, key: &str) -> Result<String, Failure> {
        let workspace = self.manifest(Path::new(""))?;
        let package = workspace.get("workspace").and_then(|table| table.get("package"));
        let value = package.and_then(|package| package.get(key)).and_then(Item::as_str);
        value.map(str::to_owned).ok_or_else(|| format!("Cargo.toml: no {key} of the workspace"))
    }

    /// What cargo is told about a folder.
    pub fn manifest(&self, folder: &Path) -> Result<DocumentMut, Failure> {
        let path = self.root.join(folder).join("Cargo.toml");
        let text = std::fs::read_to_string(&path).map_err(|e| format!("{}: {e}", path.display()))?;
        text.parse().map_err(|e| format!("{}: {e}", path.display()))
    }

    /// The text between two marks of a document.
    pub fn between(&self, document: &str, begin: &str, end: &str) -> Result<String, Failure> {
        let text = std::fs::read_to_string(self.root.join(document)).map_err(|e| format!("{document}: {e}"))?;
        let [_, inside, _] =
            split(&text, begin, end).ok_or_else(|| format!("{document} has no place for it: {begin}"))?;
        Ok(inside.to_owned())
    }

    /// Puts generated text between two marks of a document.
    pub fn fill(&self, document: &str, begin: &str, end: &str, text: &str) -> Result<(), Failure> {
        let io = |e: std::io::Error| format!("{document}: {e}");
        let path = self.root.join(document);
        let before = std::fs::read_to_string(&path).map_err(io)?;
        let [head, _, tail] =
            split(&before, begin, end).ok_or_else(|| format!("{document} has no place for it: {begin}"))?;
        std::fs::write(&path, format!("{head}{begin}{text}{end}{tail}")).map_err(io)
    }

    /// A command that runs in the top folder.
    pub fn command(&self, program: &str) -> Command {
        let mut command = Command::new(program);
        command.current_dir(&self.root);
        command
    }

    /// The cargo this program was started by.
    pub fn cargo(&self) -> Command {
        self.command(&std::env::var("CARGO").unwrap_or_else(|_| "cargo".to_owned()))
    }
}

/// Is this continuous integration, where a check may not be left out?
pub fn in_ci() -> bool {
    std::env::var("CI").is_ok_and(|value| value == "true")
}

/// Does `STAMPFLY_DATA=none` say that the checks run without the recorded flights?
pub fn without_recorded_flights() -> bool {
    std::env::var_os("STAMPFLY_DATA").is_some_and(|value| value == "none")
}

/// A text before, between and after two marks.
fn split<'t>(text: &'t str, begin: &str, end: &str) -> Option<[&'t str; 3]> {
    let (head, rest) = text.split_once(begin)?;
    let (inside, tail) = rest.split_once(end)?;
    Some([head, inside, tail])
}

/// Says what is run, runs it, and turns a failure into a sentence.
pub fn run(command: &mut Command) -> Result<(), Failure> {
    let shown = announced(command);
    let status = command.status().map_err(|e| format!("`{shown}` could not be started: {e}"))?;
    if status.success() { Ok(()) } else { Err(format!("`{shown}` ended with {status}")) }
}

/// What a command of ours printed with `--json`.
pub fn json(report: &str) -> Result<Value, Failure> {
    serde_json::from_str(report).map_err(|e| format!("{report}: {e}"))
}

/// Like [`run`], and returns what the program wrote to stdout and to stderr.
pub fn capture(command: &mut Command) -> Result<(String, String), Failure> {
    let shown = announced(command);
    let output = command.stdin(Stdio::null()).output().map_err(|e| format!("`{shown}` could not be started: {e}"))?;
    let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
    if output.status.success() {
        Ok((out, err))
    } else {
        Err(format!("`{shown}` ended with {}\n{out}{err}", output.status))
    }
}

/// A program of Python packages of these versions, `NAME==VERSION NAME==VERSION`, which are installed into a place of their own
/// when it is missing.
pub fn python_tool(repository: &Repository, packages: &str, tool: &str) -> Result<Command, Failure> {
    let place = repository.target("python").join(packages.replace("==", "-").replace(' ', "+"));
    let program = |name: &str| place.join("bin").join(name).to_string_lossy().into_owned();
    if !Path::new(&program(tool)).exists() {
        run(repository.command("python3").args(["-m", "venv"]).arg(&place))?;
        run(repository.command(&program("pip")).args(["install", "--quiet"]).args(packages.split(' ')))?;
    }
    Ok(repository.command(&program(tool)))
}

/// Makes rustup install targets that are missing.
pub fn add_targets(repository: &Repository, targets: &[&str]) -> Result<(), Failure> {
    let (installed, _) = capture(repository.command("rustup").args(["target", "list", "--installed"]))?;
    for target in targets.iter().filter(|target| !installed.lines().any(|line| line == **target)) {
        run(repository.command("rustup").args(["target", "add", target]))?;
    }
    Ok(())
}

/// Says what is run.
pub fn announced(command: &Command) -> String {
    let mut shown: Vec<String> = command
        .get_envs()
        .filter_map(|(key, value)| Some(format!("{}={}", key.to_string_lossy(), value?.to_string_lossy())))
        .collect();
    let program = Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    shown.push(program.to_string_lossy().into_owned());
    shown.extend(command.get_args().map(|argument| argument.to_string_lossy().into_owned()));
    let shown = shown.join(" ");
    eprintln!("$ {shown}");
    shown
}
