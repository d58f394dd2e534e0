//! The way FE programs write their matrices: the lines of the deck, the run, and the command that continues from there.
//! `docs/how_to/from_fe_programs.md` shows these lines as well.

use flexbody_base::diagnostic::{Code, Diagnostic};
use flexbody_base::error::Result;

/// Way from a deck of one FE program to a flexible body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recipe {
    /// Name of the program.
    pub program: &'static str,
    /// Steps in their order.
    pub steps: &'static [Step],
    /// Requirements of the model.
    pub mind: &'static str,
}

impl Recipe {
    /// Returns the recipe of a program.
    ///
    /// # Errors
    /// FB801 for a program without a recipe, with the programs that have one.
    pub fn of(program: &str) -> Result<Self> {
        let found = RECIPES.iter().copied().find(|recipe| recipe.program == program);
        found.ok_or_else(|| {
            let help = format!("name one of {}", Self::programs().join(", "));
            Diagnostic::new(Code::Usage, format!("`{program}` has no recipe")).with_help(help).into()
        })
    }

    /// Returns the names of all programs with a recipe.
    pub fn programs() -> Vec<&'static str> {
        RECIPES.iter().map(|recipe| recipe.program).collect()
    }
}

impl std::fmt::Display for Recipe {
    /// Writes every step with its place, then the requirements of the model.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.steps.iter().try_for_each(|step| write!(f, "{}:\n\n{}\n\n", step.place, step.lines))?;
        writeln!(f, "Mind: {}.\n", self.mind)?;
        writeln!(f, "Joints: {JOINTS}.")
    }
}

/// Lines with the place where they belong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// Place of the lines, in a few words.
    pub place: &'static str,
    /// Lines, without a newline after the last.
    pub lines: &'static str,
}

/// Options for the places where joints act, after any recipe.
const JOINTS: &str = "for each set of nodes where a joint or a load acts add --interface NAME=SET,rigid to the last command, and --basis craig-bampton";

/// Recipes of all FE programs.
pub const RECIPES: &[Recipe] = &[CALCULIX, ABAQUS, ANSYS, NASTRAN];

const CALCULIX: Recipe = Recipe {
    program: "calculix",
    steps: &[
        Step {
            place: "In job.inp, below the model and instead of its steps",
            lines: "*STEP\n*FREQUENCY, SOLVER=MATRIXSTORAGE\n1\n*END STEP",
        },
        Step { place: "Run, which writes job.sti, job.mas and job.dof", lines: "ccx -i job" },
        Step { place: "Convert", lines: "flexbody convert job.inp --units mm,t,s -o body.flex.h5" },
    ],
    mind: "solid elements, no *BOUNDARY and no contact",
};

const ABAQUS: Recipe = Recipe {
    program: "abaqus",
    steps: &[
        Step {
            place: "In job.inp, below the model and instead of its steps",
            lines: "*STEP\n*MATRIX GENERATE, STIFFNESS, MASS\n*MATRIX OUTPUT, STIFFNESS, MASS, FORMAT=MATRIX INPUT\n*END STEP",
        },
        Step {
            place: "Run, which writes job_STIF1.mtx and job_MASS1.mtx",
            lines: "abaqus job=job interactive",
        },
        Step { place: "Convert", lines: "flexbody convert job.inp --units mm,t,s -o body.flex.h5" },
    ],
    mind: "no *BOUNDARY and no contact; quadratic elements, since C3D4 and C3D8 have a lumped mass",
};

const ANSYS: Recipe = Recipe {
    program: "ansys",
    steps: &[
        Step {
            place: "Behind the model: its nodes, and the assembled matrices in file.full without a solution",
            lines: "/PREP7\nLUMPM,OFF\nCDWRITE,DB,part,cdb\nFINISH\n/SOLU\nANTYPE,MODAL\nMODOPT,LANB,1\nWRFULL,1\nSOLVE\nFINISH",
        },
        Step {
            place: "Then the matrices and the nodes of their rows as text",
            lines: "*SMAT,K,D,IMPORT,FULL,file.full,STIFF\n*SMAT,M,D,IMPORT,FULL,file.full,MASS\n*VEC,B,I,IMPORT,FULL,file.full,BACK\n*EXPORT,K,MMF,K.mtx\n*EXPORT,M,MMF,M.mtx\n*EXPORT,B,MMF,mapping.txt",
        },
        Step {
            place: "Convert",
            lines: "flexbody convert --stiffness K.mtx --mass M.mtx --nodes part.cdb --dofs mapping.txt --units mm,t,s -o body.flex.h5",
        },
    ],
    mind: "no supports (D), no contact and no constraint equations (CE, CP); file.full has the name of the job",
};

const NASTRAN: Recipe = Recipe {
    program: "nastran",
    steps: &[
        Step {
            place: "In job.bdf below BEGIN BULK, for SOL 103 without METHOD and SPC",
            lines: "PARAM,COUPMASS,1\nPARAM,EXTOUT,DMIGPCH\nASET1,123456,1,THRU,9999",
        },
        Step { place: "Run, which writes the matrices to job.pch", lines: "nastran job.bdf" },
        Step { place: "Convert", lines: "flexbody convert job.bdf --units mm,t,s -o body.flex.h5" },
    ],
    mind: "no SPC; the matrices have ten digits",
};
