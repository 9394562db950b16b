"""What is being designed: the text of a specification, and everything that is known about it at the moment."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from io import StringIO
from pathlib import Path
from typing import Any

from sosmith import SosmithError, Specification, SpecificationError
from sosmith.host.loopback import MessageError
from sosmith.interface.files import read_text, write_file, write_files
from sosmith.studio.document import described, told
from sosmith.studio.edits import changed
from sosmith.studio.history import History
from sosmith.studio.lane import Lane, warm_up
from sosmith.studio.messages import kind_in, short, typed
from sosmith.studio.stage_list import added, chosen, moved, removed, split, stages_of

MAX_TEXT = 1 << 16
"""Longest text of a specification, in characters."""

MAX_FILE = 8 << 20
"""Longest file that is dropped on the page, in characters."""

LATE = 1.0
"""Seconds after which a preview is given up for a newer one; before that, the newer one waits."""

_NO_ERROR: dict[str, Any] = {"error": None, "wrong": []}


class Session:
    """The state behind the page, which changes by what pages say and by what jobs say.

    The state is one tree for JSON for each topic: ``document``, ``preview``, ``proof``, ``design``, ``realizations``,
    ``trace``, ``report``, ``calibration``. `wait` returns what is new. ``design`` is that of the last proof that
    succeeded, and there is none before that.

    Parameters
    ----------
    file : Path
        Where the specification is saved; relative names in it are relative to its folder.
    text : str
        The text to begin with.
    on_disk : str or None
        Content of `file` as it was read; None if it is not the file that was read, and must not be replaced unasked.
    folder : Path
        Folder of the session, for dropped files and for the report.
    """

    def __init__(self, file: Path, text: str, on_disk: str | None, folder: Path) -> None:
        self.file = file
        self._history, self._on_disk = History(text), on_disk
        self._folder = folder
        warm_up()
        lock = threading.RLock()
        self._changed = threading.Condition(lock)
        self._versions: dict[str, int] = {}
        self._state: dict[str, Any] = {}
        self._version = 0
        self._last: tuple[str, int] = ("", 0)
        self._previews, self._proofs, self._others = Lane(lock), Lane(lock), Lane(lock)
        self._previewed, self._begun = "", 0.0
        self._queued: Callable[[], None] | None = None
        self._side_by_side, self._compared = False, 0
        self._closed = False
        self._tell("preview", _NO_ERROR)
        self._tell("realizations", {"state": "off", "rows": []})
        for topic in ("trace", "report", "calibration"):
            self._tell(topic, {"state": "none"})
        self._renew(moving=False)

    @property
    def _text(self) -> str:
        return self._history.text

    @property
    def report(self) -> Path:
        """The report of the last co-simulation, which may not exist."""
        return self._folder / "report" / "report.html"

    @property
    def processes(self) -> list[int]:
        """Ids of the processes that work for this session."""
        return [pid for lane in (self._previews, self._proofs, self._others) for pid in lane.processes]

    @property
    def busy(self) -> bool:
        """Whether any job is being done."""
        return any(lane.busy for lane in (self._previews, self._proofs, self._others))

    def wait(self, seen: int, left: threading.Event) -> tuple[int, dict[str, Any], bool]:
        """Wait for news after version `seen`; return their version, the topics that are new, and whether it is the end.

        Once `left` is set, the next call of `nudge` ends the wait.
        """
        with self._changed:
            while self._version == seen and not self._closed and not left.is_set():
                self._changed.wait()
            return (
                self._version,
                {topic: self._state[topic] for topic, version in self._versions.items() if version > seen},
                self._closed or left.is_set(),
            )

    def nudge(self) -> None:
        """Wake up all who wait."""
        with self._changed:
            self._changed.notify_all()

    def close(self) -> None:
        """End all work."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        for lane in (self._previews, self._proofs, self._others):
            lane.close()

    def handle(self, message: Any, client: str) -> None:
        """Do what a page asks for.

        Parameters
        ----------
        message : dict
            What is asked for, under ``"do"``, and how.
        client : str
            Which page it is.

        Raises
        ------
        MessageError
            If no page of ours says this.
        """
        actions: dict[str, Callable[[dict[str, Any]], None]] = {
            "change": self._change,
            "text": self._replace,
            "stages": self._rearrange,
            "undo": lambda message: self._step(self._history.undone),
            "redo": lambda message: self._step(self._history.redone),
            "save": self._save,
            "reread": self._reread,
            "realizations": self._compare,
            "trace": self._trace,
            "stop": self._stop,
            "calibration": self._calibrate,
        }
        if not isinstance(message, dict) or typed(message, "do", str) not in actions:
            raise MessageError
        with self._changed:
            self._last = client, int(typed(message, "n", int, 0))
            actions[message["do"]](message)

    # What pages ask for

    def _change(self, message: dict[str, Any]) -> None:
        changes = typed(message, "changes", dict)
        self._take(self._edited(lambda text: changed(text, changes)), moving=typed(message, "moving", bool, False))

    def _edited(self, edit: Callable[[str], str]) -> str:
        """Return the text after an edit; as it is where that cannot be made."""
        from tomlkit.exceptions import TOMLKitError

        try:
            return edit(self._text)
        except (TOMLKitError, TypeError, ValueError, AttributeError, LookupError, ArithmeticError, RecursionError):
            return self._text  # it is no TOML, a table is none, or a number is none of ours: the preview says so

    def _replace(self, message: dict[str, Any]) -> None:
        self._take(typed(message, "text", str), moving=False)

    def _rearrange(self, message: dict[str, Any]) -> None:
        """Add, remove or move a stage, make stages of a single core, or write those that were chosen."""
        what, at, to = typed(message, "what", str), typed(message, "at", int, 0), typed(message, "to", int, 0)
        choice = self._state["design"].get("chosen") if self._state["proof"]["state"] == "proven" else None
        edits: dict[str, Callable[[str], str]] = {
            "add": lambda text: added(text, kind_in(message), at),
            "remove": lambda text: removed(text, at),
            "move": lambda text: moved(text, at, to),
            "split": split,
            "chosen": lambda text: text if choice is None else chosen(text, choice["stage"], choice["limits"]),
        }
        if what not in edits or min(at, to) < 0:
            raise MessageError
        self._take(self._edited(edits[what]), moving=False)

    def _step(self, step: Callable[[], str | None]) -> None:
        if step() is None:
            self._document()
        else:
            self._renew(moving=False)

    def _take(self, text: str, *, moving: bool) -> None:
        short(text, MAX_TEXT)
        same = text == self._text
        self._history.take(text, moving=moving)
        if same and self._state["proof"]["state"] in {"working", "proven"}:
            self._document()
            return
        self._renew(moving=moving)

    def _save(self, message: dict[str, Any]) -> None:
        try:
            on_disk = _read(self.file) if self.file.exists() else None
        except (OSError, ValueError, SpecificationError):
            on_disk = ""  # it is no specification of ours: ask
        if on_disk not in {None, self._on_disk} and not typed(message, "overwrite", bool, False):
            self._document(
                question=f"{self.file.name} has changed on the disk since it was read. Overwrite it?"
                if self._on_disk is not None
                else f"There is a {self.file.name} already. Overwrite it?"
            )
            return
        try:
            write_files(self.file.parent, {self.file.name: self._text})
        except SosmithError as error:
            self._document(problem=str(error))
            return
        self._on_disk = self._text
        self._document()

    def _reread(self, message: dict[str, Any]) -> None:
        try:
            text = _read(self.file)
        except SpecificationError:
            self._document(problem=f"{self.file}: the specification must be a readable file")
            return
        self._on_disk = text
        self._take(text, moving=False)

    def _compare(self, message: dict[str, Any]) -> None:
        self._side_by_side, self._compared = typed(message, "on", bool), typed(message, "stage", int, 0)
        if self._compared < 0:
            raise MessageError
        if not self._side_by_side:
            self._others.cancel()
            self._tell("realizations", {"state": "off", "rows": []})
        elif self._state["proof"]["state"] == "proven":
            self._begin_side_by_side()

    def _trace(self, message: dict[str, Any]) -> None:
        topic = "report" if typed(message, "report", bool, False) else "trace"
        seconds = message.get("seconds")
        if seconds is not None and not isinstance(seconds, int | float):
            raise MessageError
        source = typed(message, "source", str)
        if message.get("csv") is not None:
            kept = self._dropped(topic, "trace.csv", message)
            if kept is None:
                return
            source = kept
        elif source not in self._state.get("design", {}).get("scenarios", {}):
            raise MessageError  # a name of ours, never a path
        arguments: dict[str, Any] = {"source": source, "seconds": None if message.get("csv") is not None else seconds}
        job = "trace"
        if topic == "report":
            job = "simulate"
            arguments["folder"] = str(self._folder / "report")
        self._tell(topic, {"state": "working", "step": "waiting for the proof"})

        def begin() -> None:
            self._proofs.run(self._noted(topic), job, text=self._text, path=str(self.file), **arguments)

        if self._state["proof"]["state"] == "working":
            self._queued = begin
        else:
            begin()

    def _stop(self, message: dict[str, Any]) -> None:
        self._queued = None
        for topic in ("trace", "report"):
            if self._state[topic]["state"] == "working":
                if self._state["proof"]["state"] != "working":
                    self._proofs.cancel()
                self._tell(topic, {"state": "none"})

    def _calibrate(self, message: dict[str, Any]) -> None:
        place = self._dropped("calibration", "measurements.csv", message)
        if place is None:
            return

        def news(kind: str, value: Any) -> None:
            with self._changed:
                self._noted("calibration")(kind, value)
                if kind == "result":
                    table = "calibration" if stages_of(self._text) is None else "stage.0"
                    self._change({"changes": {f"{table}.data": None, f"{table}.coefficients": value["coefficients"]}})

        self._tell("calibration", {"state": "working", "step": "fitting"})
        self._others.run(news, "calibrate", measurements=place)

    def _dropped(self, topic: str, name: str, message: dict[str, Any]) -> str | None:
        """Keep a file that was dropped on the page, under a name of ours; if the disk does not take it, say so."""
        text = short(typed(message, "csv", str), MAX_FILE)
        try:
            return str(write_file(self._folder / name, text))
        except SosmithError as error:
            self._noted(topic)("refused", str(error))
            return None

    # What follows

    def _renew(self, *, moving: bool) -> None:
        """Begin anew after a change of the text: what is known of the former one goes, or is marked as old."""
        self._document()
        if self._text != self._previewed and (not self._previews.busy or time.monotonic() > self._begun + LATE):
            self._preview()
        self._others.cancel()
        if self._side_by_side:
            self._tell("realizations", {"state": "waiting", "rows": []})
        for topic in ("trace", "report"):
            if self._state[topic]["state"] == "working" and self._queued is None:
                self._tell(topic, {"state": "none"})
            elif self._state[topic]["state"] == "done":
                self._tell(topic, self._state[topic] | {"old": True})
        if moving:
            self._proofs.cancel()
            self._tell("proof", {"state": "waiting"})
            return
        self._tell("proof", {"state": "working", "step": "beginning"})
        self._proofs.run(self._proof_news, "prove", text=self._text, path=str(self.file))

    def _document(self, **more: str) -> None:
        client, n = self._last
        former, (before, after) = self._state.get("document", {}), self._history.steps
        self._tell(
            "document",
            {
                "text": self._text,
                **described(self._text, former),
                "undo": before,
                "redo": after,
                "file": self.file.name,
                "saved": self._text == self._on_disk,
                "client": client,
                "n": n,
                **more,
            },
        )

    def _preview(self) -> None:
        self._previewed, self._begun = self._text, time.monotonic()
        last = self._last
        self._previews.run(
            lambda kind, value: self._preview_news(last, kind, value), "preview", text=self._text, path=str(self.file)
        )

    def _preview_news(self, last: tuple[str, int], kind: str, value: Any) -> None:
        with self._changed:
            request = {"client": last[0], "n": last[1]}
            if kind == "result":
                self._tell("preview", request | _NO_ERROR | value)
            else:
                error = value if kind == "refused" else "the preview must live until it is done, and has ended before"
                self._tell("preview", self._state["preview"] | request | told(error, self._previewed))
            if self._text != self._previewed:
                self._preview()

    def _proof_news(self, kind: str, value: Any) -> None:
        with self._changed:
            if kind == "step":
                self._tell("proof", {"state": "working", "step": value})
            elif kind == "result":
                self._tell("design", value)
                self._tell("proof", {"state": "proven"})
                if self._side_by_side:
                    self._begin_side_by_side()
            else:
                error = value if kind == "refused" else "the proof must live until it is done, and has ended before"
                self._tell("proof", {"state": "refused", **told(error, self._text)})
            if kind != "step" and self._queued is not None:
                begin, self._queued = self._queued, None
                begin()

    def _begin_side_by_side(self) -> None:
        rows: list[Any] = []

        def news(kind: str, value: Any) -> None:
            with self._changed:
                state = {"step": "working", "part": "working", "result": "done"}.get(kind, "none")
                if kind == "part":
                    rows.append(value)
                step = value if kind == "step" else ""
                self._tell("realizations", {"state": state, "step": step, "rows": list(rows)})

        self._tell("realizations", {"state": "working", "step": "", "rows": []})
        self._others.run(news, "side_by_side", text=self._text, path=str(self.file), stage=self._compared)

    def _noted(self, topic: str) -> Callable[[str, Any], None]:
        """Return what tells a topic about a job."""

        def news(kind: str, value: Any) -> None:
            with self._changed:
                if kind == "step":
                    self._tell(topic, {"state": "working", "step": value})
                elif kind == "result":
                    self._tell(topic, {"state": "done", "old": False, **value})
                else:
                    error = value or "the process must live until its job is done, and has ended before"
                    # a dropped file goes by its name, not by where it is kept
                    self._tell(topic, {"state": "refused", "error": error.replace(f"{self._folder}/", "")})

        return news

    def _tell(self, topic: str, tree: dict[str, Any]) -> None:
        with self._changed:
            self._version += 1
            self._versions[topic], self._state[topic] = self._version, tree
            self._changed.notify_all()


def opened(spec: Path | None, output: Path | None, folder: Path) -> Session:
    """Open the specification in the file `spec`, or the example; save to `output` if it is given.

    Raises
    ------
    SpecificationError
        If the file cannot be read. What is wrong with its content, the page says.
    """
    if spec is None:
        example = Specification.example()
        return Session(output or Path(f"{example.name}.toml"), example.toml(), None, folder)
    try:
        text = _read(spec)
    except SpecificationError:
        Specification.load(spec)  # says what is wrong with the file
        raise SpecificationError(f"{spec}: the specification must be a readable file") from None
    if len(text) > MAX_TEXT:
        raise SpecificationError(f"{spec}: the specification must be at most {MAX_TEXT} characters, not longer")
    same = output is None or output.resolve() == spec.resolve()
    return Session(output or spec, text, text if same else None, folder)


def _read(file: Path) -> str:
    """Read a specification with the line ends of its page."""
    text = read_text(file, what="the specification", max_bytes=4 * MAX_TEXT + 1)  # of any characters, and one too many
    return StringIO(text, newline=None).read()
