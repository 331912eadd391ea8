"""A cloth of a few crossing fibers and a table of measurements of it: the smallest job that can be fitted."""
import random
import struct

TABLE = """# mean radiances of a cloth that does not exist
set,light_theta_deg,light_phi_deg,camera_theta_deg,camera_phi_deg,cloth_rotation_deg,r,g,b
fit,20,0,20,180,0,0.12,0.09,0.05
fit,45,0,45,180,0,0.14,0.10,0.06
fit,60,0,0,180,0,0.06,0.04,0.02
fit,45,0,45,90,90,0.05,0.03,0.02
held-out,30,0,50,180,0,0.12,0.09,0.05
held-out,60,0,30,20,90,0.05,0.03,0.02
"""


def hair(tile_mm=0.2, radius_mm=0.008, n=8, layers=3, points=9, groups=False):
    """Returns layers of crossing fibers as the bytes of a .hair file: positions and diameters in millimetres. groups: the
    fibers along y are group 1, in colours."""
    rng = random.Random(5)
    xyz, thickness, colours, strands = [], [], [], 0
    for layer in range(layers):
        for i in range(n):
            strands += 1
            across = (i + 0.5 + 0.3 * rng.random()) * tile_mm / n
            for k in range(points):
                along = -0.02 + (tile_mm + 0.04) * k / (points - 1)
                height = 0.02 * layer + 0.004 * rng.random()
                xyz += [along, across, height] if layer % 2 == 0 else [across, along, height]
                thickness.append(2 * radius_mm)
                colours += [1.0 - layer % 2, 1.0, 1.0] if groups else []
    text = f"selvedge tile_mm={tile_mm},{tile_mm}{' groups=rgb' if groups else ''}".encode().ljust(88, b"\0")
    head = b"HAIR" + struct.pack("<IIIIfffff", strands, strands * points, 2 | 4 | (16 if groups else 0), points - 1, 2 * radius_mm, 0.0, 1.0, 1.0, 1.0) + text
    assert len(head) == 128
    return head + struct.pack(f"<{len(xyz)}f", *xyz) + struct.pack(f"<{len(thickness)}f", *thickness) + struct.pack(f"<{len(colours)}f", *colours)


def start_small_job(daemon, document, table=TABLE, groups=False):
    """Uploads cloth.hair and rows.csv (`table`), which the document names, and starts the job."""
    job = daemon.create(document)
    daemon.upload(job, "cloth.hair", hair(groups=groups), "fibers")
    daemon.upload(job, "rows.csv", table.encode(), "measurements")
    reply = daemon.post(f"/v1/jobs/{job}/start")
    assert reply.status_code == 202, reply.text
    return job
