"""The MAVLink dialect of this vehicle: `tiltwing.xml`, and `tiltwing.py` made from it by `generate.py` at build."""
