"""The public Python interface, one file per subject; its names are imported from `sosmith`.

From a scipy filter to proven and simulated hardware:

Examples
--------
>>> import scipy.signal, sosmith
>>> sos = scipy.signal.butter(3, 20.0, fs=1000.0, output="sos")
>>> spec = sosmith.Specification.from_sos(sos, sample_rate=1000.0, name="smooth", input_bits=12)
>>> design = sosmith.design(spec)
>>> proof = design.verify()
>>> report = design.simulate("noise", seconds=1.0, simulator="icarus")
>>> report.passed, bool(report.largest_error <= proof.bound <= spec.max_error)
(True, True)
"""
