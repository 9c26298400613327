"""Many flights of one mission with what nobody knows beforehand: wind, mass, balance, aerodynamics, heading.

`python -m sitl.campaign` flies them on all cores and says how many were lost and which were the worst.
"""
