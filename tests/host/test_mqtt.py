"""Publishing to an MQTT broker: a real one where there is mosquitto, with its restarts, its passwords and its TLS."""

from __future__ import annotations

import json
import shutil
import socket
import subprocess
import sys
import threading
import time
from itertools import groupby
from pathlib import Path

import pytest
from tests.commands.invocation import Invocation
from tests.host.brokers import MOSQUITTO, Subscriber, running
from tests.host.gauges import feed, gauge
from tests.host.lines import device_of
from tests.host.ports import plugged
from tests.interface.small import instrument_design

from sosmith.host.alarms import Alarm
from sosmith.host.mqtt import Broker, Publisher
from sosmith.model.errors import SpecificationError, ToolError

with_mosquitto = pytest.mark.skipif(MOSQUITTO is None, reason="there is no mosquitto on this machine")


def test_addresses_of_brokers() -> None:
    assert Broker.at("mqtt://depot", environment={}) == Broker("depot", 1883, False, "")
    found = Broker.at(
        "mqtts://[::1]:99/fleet/7/", environment={"SOSMITH_MQTT_USER": "ann", "SOSMITH_MQTT_PASSWORD": "secret"}
    )
    assert found == Broker("::1", 99, True, "fleet/7", "ann", "secret")
    assert "secret" not in repr(found)


@pytest.mark.parametrize(
    "url",
    ["depot", "http://depot", "mqtt://", "mqtt://depot/a/+/b", "mqtt://depot/a#", "mqtt://depot/a//b", "mqtt://d?x"],
)
def test_what_is_no_address(url: str) -> None:
    with pytest.raises(SpecificationError) as caught:
        Broker.at(url, environment={})
    assert str(caught.value) == f"--mqtt must be mqtt://HOST[:PORT][/TOPIC] or mqtts://..., not {url}"


def test_no_password_in_an_address() -> None:
    with pytest.raises(
        SpecificationError, match=r"^--mqtt must be without user and password, which others could see"
    ) as e:
        Broker.at("mqtt://ann:secret@depot", environment={})
    assert "secret" not in str(e.value)


def test_credentials_are_read_from_a_file_of_the_owner_only(tmp_path: Path) -> None:
    file = tmp_path / "credentials"
    file.write_text("ann:se:cret\n")
    file.chmod(0o600)
    found = Broker.at("mqtts://depot", credentials=file, environment={"SOSMITH_MQTT_USER": "bob"})
    assert (found.user, found.password) == ("ann", "se:cret")
    for mode in (0o640, 0o604, 0o620):
        file.chmod(mode)
        expected = (
            rf"credentials: the credentials must be readable by their owner only \(chmod 600\), not have mode {mode:o}$"
        )
        with pytest.raises(SpecificationError, match=expected):
            Broker.at("mqtt://depot", credentials=file)
    file.chmod(0o600)
    file.write_text("ann\n")
    with pytest.raises(SpecificationError, match=r"must be a line user:password, not something else$"):
        Broker.at("mqtt://depot", credentials=file)
    with pytest.raises(SpecificationError, match=r"must be a text that can be read, not: No such file or directory$"):
        Broker.at("mqtt://depot", credentials=tmp_path / "none")


def test_credentials_go_over_a_plain_line_only_with_a_word_from_the_user() -> None:
    known = {"SOSMITH_MQTT_USER": "ann", "SOSMITH_MQTT_PASSWORD": "secret"}
    expected = (
        "--mqtt must be mqtts://depot... with user and password, not mqtt://, which sends them in plain text: "
        "--mqtt-plain-text allows it"
    )
    with pytest.raises(SpecificationError) as caught:
        Broker.at("mqtt://depot/fleet", environment=known)
    assert str(caught.value) == expected
    assert Broker.at("mqtt://depot", plain_text=True, environment=known).password == "secret"
    for here in ("localhost", "127.0.0.1", "127.1.2.3", "[::1]"):
        assert Broker.at(f"mqtt://{here}", environment=known).password == "secret"
    for there in ("127.0.0.1.example", "10.0.0.1", "localhost.example"):
        with pytest.raises(SpecificationError, match=r"plain text"):
            Broker.at(f"mqtt://{there}", environment=known)


@pytest.mark.parametrize("name", ["fleet/#", "a+", "a\0", "\x1b[2J", "a" * 1000])
def test_a_topic_that_is_none_is_told_at_once(name: str) -> None:
    """Even if such an identity had passed the gate."""
    readings = gauge(name=name)
    with pytest.raises(SpecificationError) as caught:
        Publisher(Broker("127.0.0.1", 1, False, ""), readings, 0.0)
    shown = ascii(f"sosmith/{name}"[:1000])[1:-1]
    assert str(caught.value) == (
        f"the topic must be printable, of 1000 bytes at most, and without # and +, not {shown}"
    )


def test_without_paho_a_sentence_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "paho.mqtt", None)
    expected = "paho-mqtt must be installed for MQTT: pip install 'sosmith[mqtt]'"
    Invocation("monitor").refused(expected, "port", "--trace", "x.csv", "--mqtt", "mqtt://depot", kind=ToolError)


def test_a_broker_that_is_not_there() -> None:
    with socket.socket() as nobody:
        nobody.bind(("127.0.0.1", 0))
        port = nobody.getsockname()[1]
        with pytest.raises(ToolError) as caught:
            Publisher(Broker("127.0.0.1", port, False, ""), gauge(), 0.0)
    assert str(caught.value) == f"the broker at 127.0.0.1:{port} must be there, not: Connection refused"


def changes(reader: Subscriber) -> list[str]:
    """States without copies: what was not acknowledged in time comes again."""
    return [state for state, _ in groupby(reader.texts("sosmith/gauge/status"))]


@with_mosquitto
def test_what_is_published_and_what_stays(tmp_path: Path) -> None:
    readings = gauge()
    with running(tmp_path) as broker, Subscriber(broker.port, "sosmith/#") as reader:
        with Publisher(Broker("127.0.0.1", broker.port, False, ""), readings, 1000.0) as publisher:
            feed(readings, start=1000.0)
            publisher.alarm(Alarm("wear_critical", 1, 200, 3.25, 1002.0))
            publisher.update()
            readings.state = "lost"
            publisher.update()
            reader.until(lambda: publisher.update() or changes(reader) == ["connected", "lost"])
            # A connection that breaks off: the broker says so, until this side is back.
            publisher._client.socket().shutdown(socket.SHUT_RDWR)  # type: ignore[union-attr]
            reader.until(lambda: publisher.update() or changes(reader) == ["connected", "lost", "offline", "lost"])
        reader.until(lambda: changes(reader)[4:] == ["ended"])
        assert publisher.news() == [
            f"the broker at 127.0.0.1:{broker.port} is gone; waiting for it",
            f"the broker at 127.0.0.1:{broker.port} is connected again",
        ]
        assert [json.loads(text) for text in reader.texts("sosmith/gauge/alarm")] == [
            {
                "number": 1,
                "since": "1970-01-01T00:16:40.000Z",
                "time": "1970-01-01T00:16:42.000Z",
                "sample": 200,
                "channel": 1,
                "flag": "wear_critical",
                "value": 3.25,
                "unit": "mm",
            }
        ]
        with Subscriber(broker.port, "+/gauge/#") as late:
            late.until(lambda: len(late.messages) == 3)
            assert all(retained for *_, retained in late.messages)
            assert late.texts("sosmith/gauge/status") == ["ended"]
            (text,) = late.texts("sosmith/gauge/channel/1")
    assert json.loads(text) == {
        "time": "1970-01-01T00:16:49.990Z",
        "sample": 999,
        "quantity": "clearance",
        "unit": "mm",
        "value": 2.0,
        "wear": 1.0,
        "per_hour": pytest.approx(0.0),
        "flags": [],
    }


@with_mosquitto
def test_no_alarm_is_lost_while_the_broker_restarts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A monitor at work: its alarms come every 40 ms, before, during and after the absence of the broker."""
    monkeypatch.chdir(tmp_path)
    rows = [f"{n % 2},{4095 if n // 2 % 4 == 0 else 2000},512" for n in range(600)]
    Path("trace.csv").write_text("\n".join(["channel,voltage_code,temperature_code", *rows]) + "\n")
    arguments = ("--trace", "trace.csv", "--alarm", "input_at_rail")
    with running(tmp_path) as broker, Subscriber(broker.port, "depot/alarm") as reader:

        def restart() -> None:
            reader.until(lambda: len(reader.messages) > 10)
            broker.stop()
            time.sleep(0.5)
            broker.start()

        restarting = threading.Thread(target=restart)
        restarting.start()
        with plugged(device_of(instrument_design())) as port:
            result = Invocation("monitor").run(port, *arguments, "--mqtt", f"mqtt://127.0.0.1:{broker.port}/depot")
        restarting.join()
        assert isinstance(result.exception, SystemExit), result.exception
        assert result.exit_code == 1
        raised = [line for line in result.stderr.splitlines() if "alarm: " in line]
        assert len(raised) == 150
        assert "is gone; waiting for it" in result.stderr

        def numbers() -> list[int]:
            return [json.loads(text)["number"] for text in reader.texts("depot/alarm")]

        reader.until(lambda: 150 in numbers())
    # What was not acknowledged in time came again; without the copies, all are there, and in order.
    assert list(dict.fromkeys(numbers())) == list(range(1, 151))


@with_mosquitto
@pytest.mark.skipif(not shutil.which("openssl"), reason="there is no openssl on this machine")
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # paho forgets sockets of bad handshakes
def test_tls_and_a_password(tmp_path: Path) -> None:
    made = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-subj", "/CN=broker", "-days", "2")
    certificate, key = tmp_path / "certificate.pem", tmp_path / "key.pem"
    subject = ("-addext", "subjectAltName=IP:127.0.0.1", "-keyout", str(key), "-out", str(certificate))
    subprocess.run(["openssl", "req", "-x509", *made, *subject], check=True, capture_output=True)
    passwords = tmp_path / "passwords"
    subprocess.run(["mosquitto_passwd", "-c", "-b", str(passwords), "ann", "secret"], check=True, capture_output=True)
    lines = (f"certfile {certificate}", f"keyfile {key}", f"password_file {passwords}", "allow_anonymous false")
    with running(tmp_path, *lines) as broker:
        good = Broker("127.0.0.1", broker.port, True, "", "ann", "secret", certificate)
        with Publisher(good, gauge(), 0.0) as publisher:
            publisher.alarm(Alarm("fault", 0, 0, 0.0, 0.0))
        for bad, reason in (
            (
                Broker("127.0.0.1", broker.port, True, "", "ann", "wrong", certificate),
                "accept the connection, not: Not auth",
            ),
            (Broker("127.0.0.1", broker.port, True, "", "ann", "secret"), "be there, not: self"),
        ):
            with pytest.raises(ToolError, match=f"^the broker at 127.0.0.1:{broker.port} must {reason}"):
                Publisher(bad, gauge(), 0.0)
