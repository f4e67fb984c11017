#!/usr/bin/env python3
"""A linker for rustc that makes Xtensa code with Debian's LLVM 22, whose Xtensa back end is young.

rustc hands over bitcode (-Clinker-plugin-lto, -Cembed-bitcode=yes). It is linked and optimised as one module, changed
where the back end would fail, compiled to assembly, assembled, and linked by GNU ld. None of the changes touches what is
computed: the emulated flight's hash shows it.

| the back end | so here |
|---|---|
| cannot select a load it makes of a choice between two floating point constants | the choice is made between their bits |
| forgets the emergency spill slot of frames from 1 to 2 kB | such a function's frame is made larger |
| names the section of literals after the wrong function when it writes objects | it writes assembly, which is put right |
"""
import os
import re
import shutil
import struct
import subprocess
import sys

CPU = "-mcpu=esp32"
TRIPLE = "-mtriple=xtensa-none-elf"
CONSTANT = r"(-?[0-9][0-9a-fA-Fx.e+-]*)"
CHOICE = re.compile(
    rf"^( *)(%\S+) = select(?: [a-z]+)* (i1 \S+), float {CONSTANT}, float {CONSTANT}(?=[,\n ]).*$", re.MULTILINE)
LITERALS = re.compile(r"(\t\.literal_position\n(?:\t\.literal .*\n)*)((?:\t\.(?:section|text).*\n)+)")


def run(*command):
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        sys.exit(" ".join(command)[:400] + "\n" + done.stderr[-6000:])


def is_bitcode(path):
    with open(path, "rb") as file:
        if file.read(4) in (b"BC\xc0\xde", b"\xde\xc0\x17\x0b"):
            return True
    inside = path + ".bc"
    dump = ["llvm-objcopy-22", "--dump-section", ".llvmbc=" + inside, path, "/dev/null"]
    if subprocess.run(dump, capture_output=True).returncode == 0 and os.path.getsize(inside) > 1:
        os.replace(inside, path)
        return True
    return False


def bits(constant):
    """The bits of an f32 constant, which LLVM writes as a decimal number or as the bits of an f64."""
    value = struct.unpack(">d", bytes.fromhex(constant[2:]))[0] if constant.startswith("0x") else float(constant)
    return struct.unpack(">i", struct.pack(">f", value))[0]


def choose_bits(module):
    count = iter(range(10**9))

    def choice(match):
        indent, result, condition, yes, no = match.groups()
        chosen = f"%chosen.bits.{next(count)}"
        return (f"{indent}{chosen} = select {condition}, i32 {bits(yes)}, i32 {bits(no)}\n"
                f"{indent}{result} = bitcast i32 {chosen} to float")

    return CHOICE.sub(choice, module)


def enlarge_frame(module, function):
    """Puts two unused kilobytes on the function's stack."""
    head = rf"(^define [^\n]*@{re.escape(function)}\([^\n]*\{{\n(?:[^\n]*:[^\n]*\n)?)"
    unused = (r"\1  %unused.room = alloca [2048 x i8], align 4"
              "\n  store volatile i8 0, ptr %unused.room, align 4\n")
    return re.sub(head, unused, module, count=1, flags=re.MULTILINE)


def compile_module(bitcode, stem):
    source, assembly, object_file = stem + ".ll", stem + ".s", stem + ".o"
    run("llvm-dis-22", bitcode, "-o", source)
    with open(source) as file:
        module = choose_bits(file.read())
    llc = ["llc-22", TRIPLE, "-O3", CPU, "-function-sections", "-data-sections", "-filetype=asm", source, "-o", assembly]
    enlarged = set()
    while True:
        with open(source, "w") as file:
            file.write(module)
        done = subprocess.run(llc, capture_output=True, text=True)
        if done.returncode == 0:
            break
        failed = re.search(r"on function '@(\S+)'", done.stderr)
        if "scavenge" not in done.stderr or failed is None or failed[1] in enlarged:
            sys.exit(done.stderr[:3000])
        enlarged.add(failed[1])
        module = enlarge_frame(module, failed[1])
    with open(assembly) as file:
        text = re.sub(r"^\s*\.cfi_.*\n", "", file.read(), flags=re.MULTILINE)
    with open(assembly, "w") as file:
        # Literals stand before the section they belong to, and go where that one goes.
        file.write(LITERALS.sub(lambda m: m[2].rstrip("\n").split("\n")[-1] + "\n" + m[1] + m[2], text))
    run("llvm-mc-22", "-triple=xtensa-none-elf", CPU, "-filetype=obj", assembly, "-o", object_file)
    return object_file


def place_functions(assembly, script):
    """Writes the linker script's lines that put each function after its literals, within the reach of its loads."""
    with open(assembly) as file:
        functions = dict.fromkeys(re.findall(r"^\t\.section\t\.text\.([^\s,]+)", file.read(), re.MULTILINE))
    with open(script, "w") as file:
        for function in functions:
            # Code has any length; literals are words.
            file.write(f'. = ALIGN(4); *(".literal.{function}") *(".text.{function}")\n')


def main(arguments):
    output, scripts, objects, libraries = None, [], [], []
    arguments = iter(arguments)
    for argument in arguments:
        if argument == "-o":
            output = next(arguments)
        elif argument.startswith("-T") or argument == "--no-relax":
            scripts.append(argument)
        elif argument.endswith(".rlib"):
            libraries.append(argument)
        elif argument.endswith(".o"):
            objects.append(argument)
    folder = output + ".parts"
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    program, builtins, native = [], [], []
    for path in objects:
        (program if is_bitcode(path) else native).append(path)
    for number, library in enumerate(libraries):
        place = f"{folder}/{number}"
        os.makedirs(place)
        run("llvm-ar-22", "x", os.path.abspath(library), f"--output={place}")
        for path in sorted(f"{place}/{name}" for name in os.listdir(place) if not name.endswith(".rmeta")):
            if not is_bitcode(path):
                native.append(path)
            elif "compiler_builtins" in os.path.basename(library):
                builtins.append(path)
            else:
                program.append(path)
    linked, optimised = f"{folder}/linked.bc", f"{folder}/program.bc"
    run("llvm-link-22", *program, "-o", linked)
    run("opt-22", "-passes=internalize,globaldce,default<O2>", "--internalize-public-api-list=main,abort", linked,
        "-o", optimised)
    code = compile_module(optimised, f"{folder}/program")
    place_functions(f"{folder}/program.s", f"{folder}/functions.ld")
    run("llvm-ar-22", "rcs", f"{folder}/libbuiltins.a",
        *[compile_module(path, f"{folder}/builtin{number}") for number, path in enumerate(builtins)])
    # rustc's own list of symbols is for a linker that keeps unused ones.
    native = [path for path in native if not path.endswith("symbols.o")]
    run("xtensa-lx106-elf-ld", "-L", folder, *scripts, "--gc-sections", "-o", output, *native, code, f"{folder}/libbuiltins.a")


main(sys.argv[1:])
