//! What the ESP32-S3's memory holds, asked of the linker scripts that esp-hal has made for it and of a linker for Xtensa.
//!
//! The check of types runs the build scripts of the hardware layer and of the radio with the firmware's configuration, but links nothing: a
//! region of no length goes unnoticed there. GNU's linker takes the scripts as Espressif's does. Two things are linked here: sections as
//! large as the parts of the heap (and, to see that it can refuse, larger ones), and the radio's libraries.

use super::s3_memory::sizes::{FIRST_HEAP, SECOND_HEAP};
use crate::machine::{XTENSA, provide};
use crate::repository::{Failure, Repository, capture, json};
use object::{Object, ObjectSection, ObjectSymbol, SectionFlags};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

/// What the radio's libraries take at the least, bytes. Fewer, and they were not linked.
const RADIO_AT_LEAST: u64 = 32 * 1024;

/// Folders that build scripts have filled for the S3.
#[derive(Debug, PartialEq)]
pub struct S3Scripts {
    /// esp-hal's linker scripts.
    hal: PathBuf,
    /// Addresses of what is in ROM.
    rom: PathBuf,
    /// The radio's libraries.
    radio: PathBuf,
}

impl S3Scripts {
    /// From cargo's messages.
    pub fn read(messages: &str) -> Result<Self, Failure> {
        let folder = |package: &str| {
            for line in messages.lines() {
                let message = json(line)?;
                let is_package = message["package_id"].as_str().is_some_and(|id| id.contains(&format!("#{package}@")));
                if message["reason"] == "build-script-executed" && is_package {
                    return message["out_dir"].as_str().map(PathBuf::from).ok_or("no folder".to_owned());
                }
            }
            Err(format!("{package} has run no build script"))
        };
        Ok(Self { hal: folder("esp-hal")?, rom: folder("esp-rom-sys")?, radio: folder("esp-wifi-sys-esp32s3")? })
    }
}

/// A part of the heap: where it lies, its section and script of esp-hal's, its size, and one that cannot be there.
struct Part {
    place: &'static str,
    section: &'static str,
    script: &'static str,
    size: usize,
    too_large: usize,
}

const PARTS: [Part; 2] = [
    Part {
        place: "in the boot loader's memory",
        section: ".dram2_uninit",
        script: "dram2.x",
        size: FIRST_HEAP,
        // All memory from there on (esp-hal's `ld/esp32s3/memory.x`: from 0x3FCDB700 to 0x3FCF0000), the mask ROM's included.
        too_large: 0x3FCF_0000 - 0x3FCD_B700,
    },
    Part {
        place: "beside the data cache",
        section: ".dcache_reclaimed_uninit",
        script: "dcache_reclaimed.x",
        size: SECOND_HEAP,
        // Memory that cache and heap share (from 0x3FCF0000 to 0x3FD00000).
        too_large: 0x1_0000,
    },
];

/// Does the S3 have the memory that the firmware takes for its heap?
pub fn heap(repository: &Repository, scripts: &S3Scripts) -> Result<(), Failure> {
    provide(repository, &[&XTENSA])?;
    for part in PARTS {
        let Part { place, size, too_large, .. } = part;
        link(repository, &scripts.hal, &part, size)
            .map_err(|said| format!("the S3 has not {size} bytes {place}:\n{said}"))?;
        match link(repository, &scripts.hal, &part, too_large) {
            Err(said) if said.contains("will not fit in region") => {}
            Err(said) => return Err(format!("the linker should have found the region too small:\n{said}")),
            Ok(()) => return Err(format!("the linker gives {too_large} bytes away {place}")),
        }
        println!("esp32s3: a heap of {size} bytes links {place}, {too_large} do not");
    }
    Ok(())
}

/// Bytes of memory that the radio's libraries take, with what the program of another chip has of them as `wanted`. That is a little
/// more than the S3's program asks for: a function that the other chip's library calls may be one that nobody calls here.
pub fn radio(repository: &Repository, scripts: &S3Scripts, wanted: &[&str]) -> Result<u64, Failure> {
    provide(repository, &[&XTENSA])?;
    let libraries = libraries(&scripts.radio)?;
    let mut defined = BTreeSet::new();
    for library in &libraries {
        defined.extend(symbols(library)?);
    }
    let folder = repository.target("esp32").join("radio");
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        fs::create_dir_all(&folder)
            .and_then(|()| fs::write(&path, text))
            .map_err(|e| format!("{}: {e}", path.display()))
    };
    // What is in RAM goes where esp-hal's script puts it; our own list is not asked for.
    write("rwtext_hook.x", "")?;
    write("radio.x", RADIO_SCRIPT)?;
    let roots: Vec<String> =
        wanted.iter().filter(|name| defined.contains(**name)).map(|name| format!("-u {name}\n")).collect();
    write("roots", &roots.concat())?;
    let program = folder.join("radio.elf");
    let mut linker = repository.command("xtensa-lx106-elf-ld");
    // What esp-radio defines for the libraries is not there; it is Rust, and counted with the other program.
    linker.args(["--no-warnings", "-e", "0", "--gc-sections", "--unresolved-symbols=ignore-all"]);
    for place in [&folder, &scripts.hal, &scripts.rom] {
        linker.arg("-L").arg(place);
    }
    linker.arg(format!("@{}", folder.join("roots").display())).args(["-T", "radio.x", "-o"]).arg(&program);
    capture(linker.arg("--start-group").args(&libraries).arg("--end-group"))?;
    let bytes = in_memory(&program)?;
    if bytes < RADIO_AT_LEAST {
        return Err(format!("the radio's libraries cannot take {bytes} bytes only"));
    }
    Ok(bytes)
}

/// The parts of esp-hal's own script that say what lies where, without those that want a whole program.
const RADIO_SCRIPT: &str = "\
INCLUDE memory.x
INCLUDE alias.x
SECTIONS {
  INCLUDE rwtext.x
  INCLUDE rwdata.x
}
INCLUDE rodata.x
INCLUDE text.x
INCLUDE rom-functions.x
SECTIONS { /DISCARD/ : { *(.eh_frame*) *(.xt.*) *(.comment) *(.debug*) } }
";

/// The archives in a folder.
fn libraries(folder: &Path) -> Result<Vec<PathBuf>, Failure> {
    let fail = |e: std::io::Error| format!("{}: {e}", folder.display());
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(fail)? {
        let path = entry.map_err(fail)?.path();
        if path.extension().is_some_and(|extension| extension == "a") {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}

/// What an archive defines.
fn symbols(archive: &Path) -> Result<Vec<String>, Failure> {
    let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", archive.display());
    let bytes = fs::read(archive).map_err(|e| fail(&e))?;
    let archive = object::read::archive::ArchiveFile::parse(&*bytes).map_err(|e| fail(&e))?;
    let mut found = Vec::new();
    for member in archive.members() {
        // Copied, because members of an archive are not aligned as the reader wants them.
        let data = member.and_then(|member| member.data(&*bytes)).map_err(|e| fail(&e))?.to_vec();
        let file = object::File::parse(&*data).map_err(|e| fail(&e))?;
        let defined = file.symbols().filter(|symbol| symbol.is_definition() && symbol.is_global());
        found.extend(defined.filter_map(|symbol| Some(symbol.name().ok()?.to_owned())));
    }
    Ok(found)
}

/// Bytes of a program's sections that are not in flash.
fn in_memory(program: &Path) -> Result<u64, Failure> {
    let fail = |e: &dyn std::fmt::Display| format!("{}: {e}", program.display());
    let bytes = fs::read(program).map_err(|e| fail(&e))?;
    let file = object::File::parse(&*bytes).map_err(|e| fail(&e))?;
    let allocated = |section: &object::Section<'_, '_>| matches!(section.flags(), SectionFlags::Elf { sh_flags } if sh_flags & u64::from(object::elf::SHF_ALLOC) != 0);
    let flash = |address: u64| FLASH.iter().any(|range| range.contains(&address));
    let memory = file.sections().filter(|section| allocated(section) && !flash(section.address()));
    Ok(memory.map(|section| section.size()).sum())
}

/// Where the S3's flash is seen: constants, code (esp-hal's `ld/esp32s3/memory.x`).
const FLASH: [std::ops::Range<u64>; 2] = [0x3C00_0000..0x3E00_0000, 0x4200_0000..0x4400_0000];

/// Links a section of this size where that part of the heap goes.
fn link(repository: &Repository, scripts: &Path, part: &Part, size: usize) -> Result<(), Failure> {
    let [source, object, program] =
        ["s", "o", "elf"].map(|kind| repository.target("esp32").join(format!("heap-{size}.{kind}")));
    let section = format!(".section {},\"aw\",@nobits\nheap: .space {size}\n", part.section);
    fs::write(&source, section).map_err(|e| format!("{}: {e}", source.display()))?;
    capture(repository.command("xtensa-lx106-elf-as").arg(&source).arg("-o").arg(&object))?;
    let mut linker = repository.command("xtensa-lx106-elf-ld");
    linker.arg("-L").arg(scripts).args(["-T", "memory.x", "-T", part.script, "-e", "0", "-o"]).arg(&program);
    capture(linker.arg(&object)).map(drop)
}

#[cfg(test)]
mod tests {
    use super::S3Scripts;

    #[test]
    fn each_folder_is_its_own_packages() {
        let ran = |package: &str, folder: &str| {
            format!(
                r#"{{"reason":"build-script-executed","package_id":"registry+x#{package}@1.2","out_dir":"{folder}"}}"#
            )
        };
        let [other, hal, rom, radio] = [
            ran("esp-hal-procmacros", "/a"),
            ran("esp-hal", "/b"),
            ran("esp-rom-sys", "/c"),
            ran("esp-wifi-sys-esp32s3", "/d"),
        ];
        let all = S3Scripts::read(&[&other, &hal, &rom, &radio].map(String::as_str).join("\n")).unwrap();
        let expected = S3Scripts { hal: "/b".into(), rom: "/c".into(), radio: "/d".into() };
        assert_eq!(all, expected);
        assert!(S3Scripts::read(&[other, rom, radio].join("\n")).is_err());
    }
}
