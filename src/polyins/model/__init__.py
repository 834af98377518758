"""The words of the field as types: rigs, recordings, solutions, methods, attitudes, positions."""
