# Sourced. A Slurm of four nodes on this machine, under a folder of its own: munged, slurmctld, four slurmd. As root.

# slurm_or_skip: ends the script with 0, and says so, where there is no Slurm or one must be root for it.
slurm_or_skip() {
  local why=
  ((EUID == 0)) || why="slurmd starts jobs as root alone"
  local program
  for program in munged slurmctld slurmd sbatch; do
    command -v "$program" >/dev/null || why="$program is not here; .ci/cluster installs it"
  done
  [[ -z $why ]] || { echo "${0##*/}: SKIPPED: $why"; exit 0; }
}

declare -A slurm_pids=()
slurm_daemon() {
  local name=$1
  shift
  "$@" >>"$slurm_work/daemons.log" 2>&1 &
  slurm_pids[$name]=$!
}
slurm_node() { slurm_daemon "$1" slurmd -D -N "$1"; }

# slurm_start FOLDER: runs until slurm_stop.
slurm_start() {
  slurm_work=$1
  local host i node
  host=$(hostname -s)
  mkdir -p "$slurm_work/state" "$slurm_work/munge"
  dd if=/dev/urandom of="$slurm_work/munge/key" bs=1024 count=1 status=none
  chmod 600 "$slurm_work/munge/key"
  chmod 755 "$slurm_work" "$slurm_work/munge"
  cat >"$slurm_work/slurm.conf" <<CONF
ClusterName=try
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=17010
AuthType=auth/munge
AuthInfo=socket=$slurm_work/munge/socket
CredType=cred/munge
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$slurm_work/state
SlurmdSpoolDir=$slurm_work/spool.%n
SlurmctldPidFile=$slurm_work/slurmctld.pid
SlurmdPidFile=$slurm_work/slurmd.%n.pid
SlurmctldLogFile=$slurm_work/slurmctld.log
SlurmdLogFile=$slurm_work/slurmd.%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=batch_sched_delay=0,sched_min_interval=100000,bf_interval=1
JobRequeue=1
MinJobAge=3600
MaxJobCount=20000
KillWait=2
SlurmdTimeout=10
ReturnToService=2
NodeName=n[1-4] NodeHostname=$host NodeAddr=127.0.0.1 Port=[17011-17014] CPUs=1 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
CONF
  export SLURM_CONF=$slurm_work/slurm.conf
  slurm_daemon munged munged --foreground --force --key-file="$slurm_work/munge/key" \
    --socket="$slurm_work/munge/socket" --pid-file="$slurm_work/munge/pid" --log-file="$slurm_work/munge/log" \
    --seed-file="$slurm_work/munge/seed"
  for ((i = 0; i < 50; ++i)); do [[ -S $slurm_work/munge/socket ]] && break; sleep 0.1; done
  slurm_daemon slurmctld slurmctld -D
  for node in n1 n2 n3 n4; do slurm_node "$node"; done
  slurm_wait_for_nodes
}

slurm_wait_for_nodes() {
  local i
  for ((i = 0; i < 200; ++i)); do
    (($(sinfo -h -t idle -o %D 2>/dev/null | paste -sd+ | sed 's/^$/0/' | bc) == 4)) && return
    sleep 0.2
  done
  echo "${0##*/}: nodes: $(sinfo -h -N -o '%N %T' | paste -sd,)" >&2
  return 1
}

slurm_stop() {
  local pid
  scancel --user=root >/dev/null 2>&1 || true
  for pid in "${slurm_pids[@]}"; do kill "$pid" 2>/dev/null || true; done
  wait 2>/dev/null || true
}

# slurm_wait_for_jobs: until none is left.
slurm_wait_for_jobs() {
  local i
  for ((i = 0; i < 6000; ++i)); do
    [[ -z $(squeue -h -o %i) ]] && return
    sleep 0.2
  done
  echo "${0##*/}: jobs do not end: $(squeue -h | head -3)" >&2
  return 1
}
