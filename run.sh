# run.sh EXE PAIR
D=/work/shared/data/phantom/knee-dev-half
cat > study_$2.json <<J
{"name":"t2","region":"custom","template":"pose00","scans":[{"name":"pose00","volume":"$D/pose00.nii.gz"},{"name":"$2","volume":"$D/$2.nii.gz"}],"bones":{"labels":"$D/bones_template.nii.gz","list":[{"label":1,"name":"femur","parent":null}]}}
J
rm -rf m; nice $1 build study_$2.json --out m --quiet 2>err.txt >/dev/null; echo rc $?
