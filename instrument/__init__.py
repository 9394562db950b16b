"""The railway instrument on top of the filter: sensors, calibration, wear, vehicle, scenarios, spectra, the paper."""
