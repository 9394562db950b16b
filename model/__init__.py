"""Numbers and signals: formats, datapaths and their bit-true computation, golden chain, calibration, sensors."""
