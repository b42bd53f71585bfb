#!/usr/bin/env bash
# A cluster of virtual nodes on this machine, for tests; nothing out of FOLDER is written, and nothing
# listens but on 127.0.0.1. Takes root, munged and slurmd.
#   slurm_on_one_host.sh start FOLDER NODES PORT; export SLURM_CONF=FOLDER/slurm.conf
#   slurm_on_one_host.sh stop FOLDER
set -euo pipefail

folder=$2
if [ "$1" = stop ]; then
  for file in "$folder"/pid/* "$folder"/munge/pid; do
    if [ -s "$file" ]; then kill "$(cat "$file")" 2>/dev/null || true; fi
  done
  exit 0
fi
nodes=$3 port=$4 host=$(hostname -s)
mkdir -p "$folder"/{munge,pid,state,log}
# munged asks that others cannot write there, and can pass through to its socket.
chmod 755 "$folder"
chmod 711 "$folder/munge"
(umask 077 && dd if=/dev/urandom of="$folder/munge/key" bs=64 count=1 2>/dev/null)
chown -R munge: "$folder/munge"
runuser -u munge -- munged --key-file="$folder/munge/key" --socket="$folder/munge/socket" \
  --pid-file="$folder/munge/pid" --log-file="$folder/munge/log" --seed-file="$folder/munge/seed"
cat >"$folder/slurm.conf" <<EOF
ClusterName=tests
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket
CredType=cred/munge
CommunicationParameters=NoInAddrAny,NoCtldInAddrAny
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/state/%n
SlurmctldPidFile=$folder/pid/slurmctld
SlurmdPidFile=$folder/pid/%n
SlurmctldLogFile=$folder/log/slurmctld
SlurmdLogFile=$folder/log/%n
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
ReturnToService=2
SlurmdTimeout=10
SchedulerParameters=sched_interval=1,batch_sched_delay=0
NodeName=n[1-$nodes] NodeHostname=$host NodeAddr=127.0.0.1 Port=[$((port + 1))-$((port + nodes))] CPUs=$(nproc) RealMemory=8000
PartitionName=tests Nodes=ALL Default=YES MaxTime=INFINITE State=UP
EOF
slurmctld -f "$folder/slurm.conf"
for i in $(seq "$nodes"); do
  mkdir -p "$folder/state/n$i"
  slurmd -f "$folder/slurm.conf" -N "n$i"
done
export SLURM_CONF=$folder/slurm.conf
for _ in $(seq 100); do
  if [ "$(sinfo -h -o '%T %D' 2>/dev/null)" = "idle $nodes" ]; then exit 0; fi
  sleep 0.1
done
echo "slurm did not come up; see $folder/log" >&2
exit 1
