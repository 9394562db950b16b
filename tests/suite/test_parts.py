"""Parts of the tests: each test is in one of them, cases of one in as many as there are."""

from __future__ import annotations

import re

import pytest

TRIED = """
import pytest

@pytest.mark.parametrize("a", range(5))
def test_cases(a):
    pass

@pytest.mark.slow
def test_alone():
    pass
"""


@pytest.fixture
def tried(pytester: pytest.Pytester) -> pytest.Pytester:
    pytester.makeini("[pytest]\nmarkers =\n    slow")
    pytester.makeconftest('pytest_plugins = ["tests.suite.parts"]')
    pytester.makepyfile(TRIED)
    return pytester


def ran(tried: pytest.Pytester, *options: str) -> list[str]:
    result = tried.inline_run("-p", "no:cacheprovider", *options)
    return [
        report.nodeid.partition("::")[2]
        for report in result.getreports("pytest_runtest_logreport")
        if report.when == "call"
    ]


def test_each_test_is_in_one_part(tried: pytest.Pytester) -> None:
    parts = [ran(tried, "--part", f"{k}/3") for k in (1, 2, 3)]
    assert sorted(test for part in parts for test in part) == sorted(ran(tried))
    assert all(any("test_cases" in test for test in part) for part in parts)


def test_what_other_options_leave_out_is_in_none(tried: pytest.Pytester) -> None:
    parts = [ran(tried, "-m", "not slow", "--part", f"{k}/5") for k in range(1, 6)]
    assert [len(part) for part in parts] == [1] * 5


@pytest.mark.parametrize("stated", ["0/3", "4/3", "1", "1/0", "a/b"])
def test_what_is_no_part_is_refused(tried: pytest.Pytester, stated: str) -> None:
    result = tried.runpytest("--part", stated)
    assert result.ret == pytest.ExitCode.USAGE_ERROR
    message = f"ERROR: --part must be K/N with K from 1 to N, such as 2/10, not {stated}"
    result.stderr.fnmatch_lines([re.sub(r"([\[\]*?])", r"[\1]", message)])
