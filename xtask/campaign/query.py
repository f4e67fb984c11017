"""Runs a query of the documents. Asking for failures may find none."""

import sys

import duckdb

with open(sys.argv[1]) as file:
    result = duckdb.sql(file.read())
print(f"{len(result.fetchall()):>4} rows of {', '.join(result.columns)}")
