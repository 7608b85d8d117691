"""The tile codec's kernels, in GB/s, beside memcpy and libdeflate."""

import json

BASES = ["memcpy", "libdeflate, the payload, level/6", "libdeflate, inflating the tile"]


def measure(bench):
    program = bench.root / "build/bench/kernels_bench"
    command = [program, "--benchmark_format=json", f"--benchmark_repetitions={bench.options.rounds}",
               "--benchmark_enable_random_interleaving=true"]
    if bench.options.smoke:
        command.append("--benchmark_min_time=0.01")
    found, labels = {}, {}
    # They run at random; the table has them in the program's order.
    for row in sorted(json.loads(bench.run(*command)["out"])["benchmarks"],
                      key=lambda row: (row["family_index"], row["per_family_instance_index"])):
        if row["run_type"] != "iteration":
            continue
        if row.get("error_occurred"):
            bench.fail(f"kernels: {row['name']}: {row['error_message']}")
        name = row["run_name"].split("/repeats:")[0]
        labels[name] = row.get("label", "")
        best = found.setdefault(name, {"gb_s": 0.0, "ns": 1e9})
        best["gb_s"] = max(best["gb_s"], row["bytes_per_second"] / 1e9)
        best["ns"] = min(best["ns"], 1e9 / row["items_per_second"])
    rows = []
    for name, run in found.items():
        shown = name.replace("/", " ") if not labels[name] else f"{name.split('/')[0]}, {labels[name]}"
        rows.append([shown, f"{run['gb_s']:.2f}", f"{run['ns']:.2f}",
                     *(f"{run['gb_s'] / found[base]['gb_s']:.3g}" for base in BASES)])
    bench.add("kernels", ["kernel", "GB/s", "ns a sample", "× memcpy", "× libdeflate 6", "× libdeflate's inflate"], rows,
              "One tile of 212 x 243 samples of made-up terrain, on one core, the best of "
              f"{bench.options.rounds} runs that take turns; u16 where nothing else is said. GB of samples, 2 bytes each of "
              "u16, 1 of u8 and 4 of f32, whatever a kernel reads and writes. memcpy: of the samples; libdeflate 6 compresses "
              "the tile's payload, its inflate makes that again of the tile as it is stored.")
    bench.results["kernels"] = found
