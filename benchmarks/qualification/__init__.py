"""Qualification on one's own machine: requirements, the tests that show them, and one page with what came of it.

python -m benchmarks.qualification             run the tests of all requirements, and write build/qualification/
python -m benchmarks.qualification --slow      with all sweeps
python -m benchmarks.qualification --document  only write the tables of docs/assurance.md
"""
