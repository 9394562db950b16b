"""The serial port: a whole session over a pseudo-terminal, ports that are taken, and ports that vanish."""

import os
import threading
from pathlib import Path

import numpy as np
import pytest
import serial
from tests.host.lines import device_of, plain_device
from tests.host.ports import plugged
from tests.interface.small import filter_design

import sosmith
from sosmith.model.link.device import Device
from sosmith.sim.virtual_board.terminal import Terminal


@pytest.mark.parametrize("baud", [115_200, 1_000_000, 3_000_000])
def test_a_session_over_a_port(baud: int) -> None:
    made = filter_design()
    codes = np.random.default_rng(1).integers(-512, 512, (3000, 1))
    with plugged(device_of(made)) as port, sosmith.Board(port, baud=baud) as board:
        assert np.array_equal(board.run_codes(codes).codes, made.core.datapath.compute(codes))


def test_a_port_is_for_one_program() -> None:
    message = r"^/dev/pts/\d+ must be a serial port that is free, not: in use by another program$"
    expected = pytest.raises(sosmith.ToolError, match=message)
    with plugged(plain_device()) as port, sosmith.Board(port), expected:
        sosmith.Board(port)


def test_a_file_is_no_port(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(sosmith.ToolError, match=r"file must be a serial port that is free, not: no serial port$"):
        sosmith.Board(str(tmp_path / "file"))


def test_unplugging_and_replugging(tmp_path: Path) -> None:
    made, device, link = filter_design(), plain_device(), tmp_path / "port"
    codes = np.random.default_rng(1).integers(-512, 512, (200, 1))
    expected = made.core.datapath.compute(codes)
    for _ in range(50):
        with plugged(device, link) as port:
            board = sosmith.Board(port)
            assert np.array_equal(board.run_codes(codes).codes, expected)
        with pytest.raises(sosmith.LinkLostError, match=r"/port must stay connected, not: "):
            board.run_codes(codes)
        board.close()
        with pytest.raises(sosmith.ToolError, match=r"/port must be a serial port that is free, not: "):
            sosmith.Board(port)


def test_unplugging_in_the_middle_of_a_stream() -> None:
    stopped = threading.Event()
    with plugged(plain_device()) as port:
        board = sosmith.Board(port)

        def progress(done: int, total: int) -> None:
            if done > 1000 and not stopped.is_set():
                stopped.set()

        lost: list[Exception] = []

        def stream() -> None:
            try:
                while True:
                    board.run_codes(np.zeros((5000, 1), int), progress)
            except sosmith.LinkError as error:
                lost.append(error)

        thread = threading.Thread(target=stream)
        thread.start()
        stopped.wait(20)
    thread.join(20)
    assert [type(error) for error in lost] == [sosmith.LinkLostError]
    board.close()


def test_a_port_that_vanishes_while_it_is_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    """Between the opening and the look at what waits; termios has an error of its own, which is no OSError."""
    terminal = Terminal()
    real = serial.Serial.reset_input_buffer

    def unplugged(port: serial.Serial) -> None:
        terminal.__exit__(None, None, None)
        real(port)

    monkeypatch.setattr(serial.Serial, "reset_input_buffer", unplugged)
    message = rf"^{terminal.path} must be a serial port that is free, not: Input/output error$"
    with pytest.raises(sosmith.ToolError, match=message):
        sosmith.Board(terminal.path)


def test_a_port_that_vanishes_after_any_byte() -> None:
    for sent in (0, 1, 2, 11, 12, 13, 80):
        terminal, device = Terminal(), plain_device()

        def answer(left: int, terminal: Terminal = terminal, device: Device = device) -> None:
            while left > 0:
                said = device.feed(os.read(terminal.end, 4096))[:left]
                left -= os.write(terminal.end, said)
            terminal.__exit__(None, None, None)

        board = threading.Thread(target=answer, args=(sent,))
        board.start()
        with pytest.raises(sosmith.ToolError, match=r"^/dev/pts/\d+ must (stay connected|be a serial port)"):
            sosmith.Board(terminal.path)
        board.join()
