"""Texts that an FMU of FMI 2.0 logs have the numbers that it gives with them."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest

from slide_fmu.importer.logger_callbacks import MEMORY, callbacks_of_fmi2
from tests.own_models.quarter_car import compiled

SOURCE = r"""
#include <stddef.h>
#include "fmi2FunctionTypes.h"
#define LOG(...) calls->logger(NULL, "one", fmi2Warning, "category", __VA_ARGS__)
void log_all(const fmi2CallbackFunctions *calls) {
    calls->logger(NULL, "one", fmi2OK, "category", "all is well");
    LOG("100 %% of %s at %g s: %d, %5.1f, %.3e", "nothing", 0.5, -7, 2.25, 1e-9);
    LOG("%ld %x %c %*d", 123456789012L, 255, 'z', 4, 42);
    LOG("%g %g %g %g %g %g %g %g %g %g", 1., 2., 3., 4., 5., 6., 7., 8., 9.5, 10.5);
    LOG("%d %g %d %g %d %g %d", 1, 0.1, 2, 0.2, 3, 0.3, 4);
    LOG("unknown %Lf", (long double)1.0);
    LOG("a %s that nothing was given for", (const char *)1);
}
"""


@pytest.mark.skipif(not Path(MEMORY).exists(), reason="texts in texts are read on Linux alone")
def test_numbers_of_logged_texts_are_put_into_them(tmp_path: Path) -> None:
    library = ctypes.CDLL(str(compiled(SOURCE, tmp_path / "log.so", ())))
    texts: list[str] = []
    callbacks = callbacks_of_fmi2(texts)
    library.log_all(ctypes.byref(callbacks))
    assert texts == [
        "100 % of nothing at 0.5 s: -7,   2.2, 1.000e-09",
        "123456789012 ff z   42",
        "1 2 3 4 5 6 7 8 9.5 10.5",
        "1 0.1 2 0.2 3 0.3 4",
        "unknown %Lf",
        "a %s that nothing was given for",
    ]
