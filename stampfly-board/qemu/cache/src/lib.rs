//! A plug-in of QEMU: what caches in front of the flash would miss, pass by pass of the flight band.
//!
//! QEMU executes an instruction in no particular time. On an ESP32-S3 most of a pass's time is spent in waiting for code from flash, so
//! counting instructions alone says little. This plug-in follows every instruction and every reading of the emulated program through
//! models of the two caches ([`cache`]) and writes what it has found ([`passes`]) into a file when the emulation ends. It is
//! loaded by `cargo xtask cache`, which knows the program's addresses:
//!
//! `-plugin FILE,out=FILE,begins=ADDRESS,ground=ADDRESS,armed=ADDRESS,aside=ADDRESS,back=ADDRESS,counts=ADDRESS,code=START:END,constants=START:END,ram=START:END`
//!
//! Addresses are hexadecimal; `ram` may be given many times. For QEMU 7.2 to 8.2, whose interface has version 1.

pub mod cache;
pub mod passes;

use passes::{Layout, Passes};
use std::ffi::{CStr, c_char, c_int, c_uint, c_void};
use std::ops::Range;
use std::sync::Mutex;

/// QEMU's own types, of which only addresses are known here.
#[repr(C)]
struct Block(c_void);
#[repr(C)]
struct Instruction(c_void);

type Callback = extern "C" fn(c_uint, *mut c_void);
type MemoryCallback = extern "C" fn(c_uint, u32, u64, *mut c_void);

// QEMU 7.2, include/qemu/qemu-plugin.h.
unsafe extern "C" {
    fn qemu_plugin_register_vcpu_tb_trans_cb(id: u64, callback: extern "C" fn(u64, *mut Block));
    fn qemu_plugin_tb_n_insns(block: *const Block) -> usize;
    fn qemu_plugin_tb_get_insn(block: *const Block, index: usize) -> *mut Instruction;
    fn qemu_plugin_insn_vaddr(instruction: *const Instruction) -> u64;
    fn qemu_plugin_register_vcpu_insn_exec_cb(
        at: *mut Instruction,
        callback: Callback,
        flags: c_int,
        user: *mut c_void,
    );
    fn qemu_plugin_register_vcpu_mem_cb(
        at: *mut Instruction,
        callback: MemoryCallback,
        flags: c_int,
        access: c_int,
        user: *mut c_void,
    );
    fn qemu_plugin_mem_is_store(access: u32) -> bool;
    fn qemu_plugin_register_atexit_cb(id: u64, callback: extern "C" fn(u64, *mut c_void), user: *mut c_void);
}

/// A callback that looks at no registers.
const NO_REGISTERS: c_int = 0;
/// Readings and writings of memory. QEMU 7.2 calls for writings when asked for readings alone.
const READS_AND_WRITES: c_int = 3;

/// The version of the interface that this is written for.
#[unsafe(no_mangle)]
#[allow(non_upper_case_globals, reason = "the name is QEMU's")]
pub static qemu_plugin_version: c_int = 1;

/// What is followed, and where it is written in the end.
static STATE: Mutex<Option<(Passes, String)>> = Mutex::new(None);

/// Nothing panics while it has the state: a poisoned one is as good.
fn with(what: impl FnOnce(&mut Passes)) {
    if let Some((passes, _)) = STATE.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).as_mut() {
        what(passes);
    }
}

extern "C" fn executes(_core: c_uint, address: *mut c_void) {
    with(|passes| passes.executes(address as u64));
}

extern "C" fn accesses(_core: c_uint, access: u32, address: u64, _: *mut c_void) {
    // SAFETY: QEMU's own function, of the value it has handed.
    if !unsafe { qemu_plugin_mem_is_store(access) } {
        with(|passes| passes.reads(address));
    }
}

/// QEMU has read a block of instructions that it will execute, perhaps often.
extern "C" fn translates(_id: u64, block: *mut Block) {
    // SAFETY: QEMU hands a block and instructions of it that live until this returns; the callbacks get an address of the emulated
    // program as a number, nothing of QEMU's.
    unsafe {
        for index in 0..qemu_plugin_tb_n_insns(block) {
            let instruction = qemu_plugin_tb_get_insn(block, index);
            let address = qemu_plugin_insn_vaddr(instruction) as *mut c_void;
            qemu_plugin_register_vcpu_insn_exec_cb(instruction, executes, NO_REGISTERS, address);
            qemu_plugin_register_vcpu_mem_cb(
                instruction,
                accesses,
                NO_REGISTERS,
                READS_AND_WRITES,
                std::ptr::null_mut(),
            );
        }
    }
}

extern "C" fn exits(_id: u64, _: *mut c_void) {
    if let Some((passes, out)) = STATE.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).take()
        && let Err(error) = std::fs::write(&out, passes.to_string())
    {
        eprintln!("{out}: {error}");
    }
}

/// Understands the words after the plug-in's name.
fn arguments<'a>(words: impl Iterator<Item = &'a str>) -> Option<(Layout, String)> {
    let address = |text: &str| u64::from_str_radix(text, 16).ok();
    let range = |text: &str| -> Option<Range<u64>> {
        let (start, end) = text.split_once(':')?;
        Some(address(start)?..address(end)?)
    };
    let mut layout = Layout::default();
    let mut out = None;
    for word in words {
        let (name, value) = word.split_once('=')?;
        match name {
            "out" => out = Some(value.to_owned()),
            "begins" => layout.begins = address(value)?,
            "ground" => layout.ends_on_ground = address(value)?,
            "armed" => layout.ends_armed = address(value)?,
            "aside" => layout.aside_begins = address(value)?,
            "back" => layout.aside_ends = address(value)?,
            "counts" => layout.counts = address(value)?,
            "code" => layout.code = range(value)?,
            "constants" => layout.constants = range(value)?,
            "ram" => layout.ram.push(range(value)?),
            _ => return None,
        }
    }
    Some((layout, out?))
}

/// QEMU loads the plug-in.
///
/// # Safety
/// QEMU calls it, with `count` strings in `words`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn qemu_plugin_install(
    id: u64,
    _about: *const c_void,
    count: c_int,
    words: *const *const c_char,
) -> c_int {
    let words = (0..usize::try_from(count).unwrap_or(0)).map(|index| {
        // SAFETY: as the caller promises.
        unsafe { CStr::from_ptr(*words.add(index)) }.to_str().unwrap_or_default()
    });
    let Some((layout, out)) = arguments(words) else {
        eprintln!("cache: arguments not understood");
        return -1;
    };
    *STATE.lock().unwrap_or_else(|poisoned| poisoned.into_inner()) = Some((Passes::new(layout), out));
    // SAFETY: the functions have the types that QEMU's header asks for and live as long as the plug-in.
    unsafe {
        qemu_plugin_register_vcpu_tb_trans_cb(id, translates);
        qemu_plugin_register_atexit_cb(id, exits, std::ptr::null_mut());
    }
    0
}
