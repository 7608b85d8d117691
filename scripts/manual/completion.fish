# fish completion for isohf and isohf-view.
for line in (string split -- \n '@TABLE@')
    set -l fields (string split -m 4 -- ';' $line)
    set -l in_command
    test $fields[1] = all; or set in_command -n "__fish_seen_subcommand_from $fields[1]"
    if test -z $fields[2]
        complete -c isohf -n __fish_use_subcommand -f -a $fields[1] -d $fields[5]
        continue
    end
    set -l names
    for name in (string split -- ' ' $fields[2])
        switch $name
            case '--*'
                set -a names -l (string sub -s 3 -- $name)
            case '*'
                set -a names -s (string sub -s 2 -- $name)
        end
    end
    set -l value
    test -z $fields[3]; or set value -r
    test -z $fields[4]; or set value -x -a $fields[4]
    complete -c isohf $in_command $names $value -d $fields[5]
end
complete -c isohf-view -w 'isohf view'
