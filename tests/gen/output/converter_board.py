"""A specification with converters."""

SPEC = {
    "name": "gauge",
    "sample_rate": 100,
    "channels": 5,
    "input": {"voltage": {"bits": 16, "range": [0.0, 10.0]}, "temperature": {"bits": 12, "range": [-32.0, 96.0]}},
    "calibration": {"coefficients": [[1.16, -0.0036], [0.3672]]},
    "filter": {"family": "butterworth", "kind": "lowpass", "order": 1, "cutoff": 10.0},
    "output": {"bits": 12, "range": [0.0, 16.0], "unit": "mm"},
    "converter": {"voltage": {"device": "mcp3204", "range": [0.0, 10.0]}, "temperature": {"device": "max31855"}},
    "hardware": {"realization": "df1_ef1", "architecture": "parallel"},
}
