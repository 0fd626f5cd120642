# cmake -DLIBRARY=FILE -DLD= -DNM= -DOBJCOPY= -DAR= -P seal_library.cmake: makes one object of a static library, whose inline
# functions and templates are its own. If several objects define a function, a linker takes the first: without this a program
# that is compiled without optimization, or for another processor, would give the library its slower copies of Eigen's functions.
cmake_minimum_required(VERSION 3.25)
set(whole ${LIBRARY}.o)
execute_process(COMMAND ${LD} -r --force-group-allocation -o ${whole} --whole-archive ${LIBRARY} COMMAND_ERROR_IS_FATAL ANY)
execute_process(COMMAND ${NM} --defined-only --format=posix ${whole} OUTPUT_VARIABLE symbols COMMAND_ERROR_IS_FATAL ANY)
string(REGEX MATCHALL "[^ \n]+ [WV] " weak "${symbols}")
list(TRANSFORM weak REPLACE " . $" "\n")
list(JOIN weak "" weak)
file(WRITE ${whole}.weak "${weak}")
execute_process(COMMAND ${OBJCOPY} --localize-symbols=${whole}.weak ${whole} COMMAND_ERROR_IS_FATAL ANY)
file(REMOVE ${LIBRARY})
execute_process(COMMAND ${AR} rcs ${LIBRARY} ${whole} COMMAND_ERROR_IS_FATAL ANY)
file(REMOVE ${whole} ${whole}.weak)
