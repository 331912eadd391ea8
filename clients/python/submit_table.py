"""Example: fit one scan to each of several tables of measurements, and print the errors.

    python3 clients/python/submit_table.py scan.tif 2.0 measured/*.csv
"""
import os
import sys

import selvedge


def main(scan, voxel_um, *tables):
    client = selvedge.Client()
    for table in tables:
        job = client.create({"sample": os.path.basename(table), "volume": {"files": [os.path.basename(scan)], "voxel_size_um": float(voxel_um)},
                             "measurements": {"file": os.path.basename(table)}})
        job.upload(scan, "volume")
        job.upload(table, "measurements")
        job.start()
        job.wait()
        result = job.result()
        print(f"{os.path.basename(table)}: fitted {100 * result.fit_rel_rms:.1f} %, held out {100 * result.heldout_rel_rms:.1f} %")


if __name__ == "__main__":
    if len(sys.argv) < 4:
        sys.exit(__doc__)
    main(*sys.argv[1:])
