"""What bench/relume-bench and bench/stability share: cached runs, their times and errors, charts and pages.

Everything is rendered, filtered and compared by the product's own commands. The modules:

    programs    where the programs are, and their digests
    scenes      a view: a scene file with its options and size
    farm        a server and a worker that stay warm from run to run, and the processor time they take
    runs        render, denoise, compare: each done once, then read from the store
    exr         reads and shrinks what relume writes
"""
