#!/bin/sh
# status.sh JOB: success, failed or running, as Snakemake asks. A job that Slurm has forgotten is
# called failed, for it would be waited for without end: tried again, it finds its result and ends.
state=$(scontrol --oneliner show job "$1" 2>/dev/null | sed -n 's/.* JobState=\([A-Z_]*\).*/\1/p')
case "$state" in
  COMPLETED) echo success ;;
  BOOT_FAIL | CANCELLED | DEADLINE | FAILED | OUT_OF_MEMORY | TIMEOUT) echo failed ;;
  "") if scontrol ping | grep -q 'is UP'; then echo failed; else echo running; fi ;;
  *) echo running ;; # also NODE_FAIL and PREEMPTED: it is queued again
esac
