#!/bin/sh
# job.sh SLCMAP JOB THREADS LOG MARK: does a job of the site in the current folder. What follows is left
# alone, so that a cluster may start this instead of the script that Snakemake hands it: then nodes
# need no Snakemake, and lose no time with its start.
mkdir -p "${4%/*}" "${5%/*}" && "$1" batch . --job "$2" --threads "$3" >"$4" 2>&1 && touch "$5"
