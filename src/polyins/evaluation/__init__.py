"""How good a solution is: errors against a reference, outages, drift, consistency."""
