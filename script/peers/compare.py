"""CPU seconds and memory of one picture, by prismarch and by Cycles: compare.py PROGRAM PYTHON FOLDER [NAME...]"""

import os
import subprocess
import sys
from pathlib import Path

import asset

WIDTH, HEIGHT, SAMPLES = 640, 480, 16
HERE = Path(__file__).parent


def spent(command):
    """CPU seconds and MB of a process and its threads."""
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    said = child.stderr.read()
    _, status, usage = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        sys.exit(f"{command[0]} failed:\n{said.decode(errors='replace')}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024


def main():
    program, python, folder, *names = sys.argv[1:]
    folder = Path(folder).resolve()
    threads = os.cpu_count()
    print(f"{WIDTH}x{HEIGHT}, {SAMPLES} samples, {threads} threads; whole processes, loading included\n")
    print("| demo | prismarch, CPU s | Cycles, CPU s | ratio | prismarch, MB | Cycles, MB |")
    print("| --- | --- | --- | --- | --- | --- |")
    for name in names or ["asteroid", "stump", "dragon"]:
        place = folder / name
        subprocess.run(
            [program, "demo", name, "--out", place, "--no-render", "--force", "--quiet"],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        scene = place / "peers.toml"
        asset.write_toml(asset.read(place, name), scene)
        ours, our_memory = spent(
            [program, "render", scene, "-o", place / "prismarch.exr", "--size", f"{WIDTH}x{HEIGHT}"]
            + ["--spp", str(SAMPLES), "--threads", str(threads), "--aovs", "none", "--quiet"]
        )
        cycles = [python, HERE / "in_cycles.py", place, name, WIDTH, HEIGHT, SAMPLES, threads, place / "cycles.exr"]
        theirs, their_memory = spent([str(word) for word in cycles])
        print(f"| {name} | {ours:.1f} | {theirs:.1f} | {ours / theirs:.2f} | {our_memory:.0f} | {their_memory:.0f} |", flush=True)


main()
