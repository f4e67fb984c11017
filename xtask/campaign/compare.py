"""Are the flights of two folders the same rows? Every column is compared."""

import sys

import duckdb

folders = sys.argv[1:]
for name, folder in zip(["one", "many"], folders):
    duckdb.sql(f"CREATE VIEW {name} AS SELECT * FROM '{folder}/*.parquet'")
count = duckdb.sql("SELECT count(*) FROM one").fetchall()[0][0]
different = duckdb.sql("(FROM one EXCEPT ALL FROM many) UNION ALL (FROM many EXCEPT ALL FROM one)").fetchall()
if count == 0 or different:
    sys.exit(f"{len(different)} rows differ, of {count}: {different[:4]}")
hashes = duckdb.sql("SELECT count(DISTINCT log_hash) FROM many").fetchall()[0][0]
print(f"{count} rows are the same, with {hashes} different hashes")
