"""The command `studio`: a page on this machine where a filter, or a chain of stages, is designed by looking."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from sosmith.output_paths import output_option
from sosmith.terminal import note


@click.command("studio")
@click.argument("spec", required=False, type=click.Path(path_type=Path))
@output_option(
    "File to save the specification to.  [default: SPEC, or the example's name in this folder]", in_place=True
)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=0, help="TCP port on the loopback address.  [default: a free one]"
)
@click.option("--no-browser", is_flag=True, help="Do not open a browser.")
def studio_command(spec: Path | None, output: Path | None, port: int, no_browser: bool) -> None:
    """Design by looking: a page with the design of SPEC, or of the example, live and proven.

    Edges and the mask are dragged or typed; the response follows at once, and the proof runs behind. The stages of a
    chain stand in a list, in which they are added, dragged, edited and removed; every step can be undone. The address
    of the page is the first line on stdout. It is served to this machine only, and only at its full address. Nothing is
    written unless it is saved on the page. Ctrl-C ends it.

    \b
        sosmith studio my.toml
        sosmith studio -o new.toml --no-browser
    """
    import tempfile
    import threading

    from sosmith.studio.lane import warm_up

    warm_up()  # loads what designs need while the server is loaded

    from sosmith.studio.server import Studio
    from sosmith.studio.session import opened

    with tempfile.TemporaryDirectory(prefix="sosmith-studio-") as folder:
        session = opened(spec, output, Path(folder))
        with Studio(session, port) as studio:
            click.echo(studio.address)
            sys.stdout.flush()
            note(f"the studio saves to {session.file}; Ctrl-C ends it")
            if not no_browser:
                click.launch(studio.address)
            threading.Event().wait()
