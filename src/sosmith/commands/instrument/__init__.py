"""Commands of the instrument: from measurements to coefficients, and from traces to motion and wear."""
