"""Yosys as a program, from the package pyosys, which is native code and has none of its own.

Takes what the product, the tests and sby call it with: `-q`, `-l LOG`, `-p COMMANDS` or a file of commands.
"""

import os
import re
import sys
from argparse import ArgumentParser
from pathlib import Path

SHOWN = re.compile(r"\b(Warning|ERROR): ")


def main() -> None:
    """Run the commands; an error of one ends this process with status 1."""
    parser = ArgumentParser()
    parser.add_argument("-q", action="store_true", required=True, help="show nothing but warnings and errors")
    parser.add_argument("-l", metavar="LOG", default=os.devnull, help="write all output to this file")
    parser.add_argument("-p", metavar="COMMANDS", help="run these commands")
    parser.add_argument("file", nargs="?", help="run the commands in this file")
    asked = parser.parse_args()
    read, write = os.pipe()
    # An error leaves no time to look at the output: what does so is a process of its own, which ends with this one.
    if os.fork() == 0:
        os.close(write)
        filtered(read, Path(asked.l))
        os._exit(0)
    os.close(read)
    os.dup2(write, 1)
    os.close(write)
    from pyosys import libyosys  # noqa: PLC0415 - it writes to what is the output when it is loaded

    if asked.file:
        libyosys.run_pass(f"script {asked.file}")
    if asked.p:
        libyosys.run_pass(asked.p)


def filtered(source: int, log: Path) -> None:
    """Write all output to the log, and warnings and errors to stderr."""
    with open(source, encoding="utf-8", errors="replace") as output, log.open("w", encoding="utf-8") as whole:
        for line in output:
            whole.write(line)
            if SHOWN.search(line):
                sys.stderr.write(line)
                sys.stderr.flush()


if __name__ == "__main__":
    main()
