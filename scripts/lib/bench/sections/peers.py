"""The same raster through every compressor at hand: GDAL's codecs and COG, maketx, JPEG XL, JPEG 2000."""

GDAL_CODECS = {"DEFLATE": ["COMPRESS=DEFLATE", "PREDICTOR=2"], "ZSTD": ["COMPRESS=ZSTD", "PREDICTOR=2"],
               "LERC_DEFLATE": ["COMPRESS=LERC_DEFLATE", "MAX_Z_ERROR=0"], "LZW": ["COMPRESS=LZW", "PREDICTOR=2"]}


def creation(options):
    return [word for option in [*options, "NUM_THREADS=2"] for word in ("-co", option)]


def measure(bench):
    # Half the width and height of the other sections: JPEG XL and JPEG 2000 take their time.
    full = "1024x512" if bench.options.smoke else "8192x4096"
    size = ["953", "549"] if bench.options.smoke else ["7623", "4402"]
    source = bench.terrain(full)
    rounds = 1 if bench.options.smoke else min(bench.options.rounds, 3)
    archive = bench.work / "peers.isohf"
    jobs = {"isohf convert --step 1": [*bench.convert, source, "-o", archive, "--overwrite", "--quiet", "--step",
                                       "1"]}
    made = {"isohf convert --step 1": archive}

    def add(name, path, command):
        jobs[name], made[name] = command, path

    for codec, options in GDAL_CODECS.items():
        path = bench.work / f"peers_{codec}.tif"
        add(f"gdal_translate {codec}", path, ["gdal_translate", "-q", "-r", "bilinear", "-outsize", *size, "-co",
                                              "TILED=YES", *creation(options), source, path])
    path = bench.work / "peers_warp.tif"
    add("gdalwarp ZSTD", path, ["gdalwarp", "-q", "-multi", "-overwrite", "-r", "bilinear", "-ts", *size, "-co", "TILED=YES",
                                *creation(GDAL_CODECS["ZSTD"]), source, path])
    for codec in ("DEFLATE", "ZSTD"):
        path = bench.work / f"peers_cog_{codec}.tif"
        add(f"gdal_translate COG {codec}", path, ["gdal_translate", "-q", "-of", "COG", "-r", "bilinear", "-outsize", *size,
                                                  *creation([f"COMPRESS={codec}", "PREDICTOR=YES"]), source, path])
    if bench.has("peers", "maketx", "openimageio-tools"):
        path = bench.work / "peers_maketx.tif"
        add("maketx zip", path, ["maketx", "--threads", "2", "--compression", "zip", "-d", "uint16", source, "-o", path])
    # These two resample nothing: they get what gdal_translate made, once.
    pgm = bench.work / "peers.pgm"
    bench.run("gdal_translate", "-q", "-r", "bilinear", "-outsize", *size, "-of", "PNM", "-ot", "UInt16", source, pgm)
    if bench.has("peers", "cjxl", "libjxl-tools"):
        path = bench.work / "peers.jxl"
        effort = "3" if bench.options.smoke else "7"
        add(f"cjxl -d 0 -e {effort}", path, ["cjxl", pgm, path, "-d", "0", "-e", effort, "--num_threads=2", "--quiet"])
    if bench.has("peers", "opj_compress", "libopenjp2-tools"):
        path = bench.work / "peers.jp2"
        add("opj_compress", path, ["opj_compress", "-i", pgm, "-o", path, "-threads", "2"])
    found = bench.in_turn(jobs, rounds)
    samples = {"isohf convert --step 1": bench.info(archive)["lattice_samples"]}
    columns, rows_ = map(int, full.split("x"))
    samples["maketx zip"] = columns * rows_
    us = found["isohf convert --step 1"]
    rows = []
    for name, run in found.items():
        run["bytes"] = made[name].stat().st_size
        run["samples"] = samples.get(name, int(size[0]) * int(size[1]))
        bits = 8 * run["bytes"] / run["samples"]
        our_bits = 8 * us["bytes"] / us["samples"]
        rows.append([name, f"{run['wall_s']:.2f}", f"{run['cpu_s']:.2f}", f"{run['peak_mb']:.0f}", f"{bits:.2f}",
                     *(f"{run[key] / us[key]:.2f}" for key in ("wall_s", "cpu_s", "peak_mb")), f"{bits / our_bits:.2f}"])
        made[name].unlink()
    pgm.unlink()
    note = (f"{source.name}, medians of {rounds} rounds, {bench.machine()}; the last four columns: divided by isohf's. GDAL "
            "resamples to as many samples as the lattice has. maketx resamples nothing but makes the smaller levels, a third "
            "more samples, which count as bytes; COG makes overviews likewise. JPEG XL and JPEG 2000 get the samples "
            "resampled, as a picture.")
    bench.add("peers", ["program", "wall s", "cpu s", "peak MB", "bits a sample", "wall ×", "cpu ×", "peak ×", "bits ×"], rows,
              note)
    bench.results["peers"] = found
