//! The command line: dispatch, and one file per verb.

mod apply;
mod calibrate;
mod characterize;
mod check;
mod compare;
mod completions;
mod context;
mod demo;
mod error;
mod export;
mod interrupt;
mod judging;
mod layout;
mod man;
mod new;
mod one_of;
mod optimize;
mod output;
mod outputs;
mod plan;
mod progress;
mod report;
mod schema;
mod score;
mod simulate;
mod study;
mod tolerance;
mod trace;
mod validate;

use clap::{CommandFactory, Parser, Subcommand};
use context::{Context, Global};
use error::CliError;
use progress::Reporter;
use std::ffi::OsString;
use std::sync::Arc;

/// Printed at the end of every help text.
const EXIT_CODES: &str = "Exit codes: 0 ok · 1 the verdict is \"not good enough\" · 2 usage or invalid input · \
                          3 input/output · 130 interrupted · 143 terminated · 129 hung up";

/// Simulator and calibration testbed for 2D LiDARs that see in 3D through mirrors.
#[derive(Debug, Parser)]
#[command(name = "catoptric", version, after_help = EXIT_CODES, arg_required_else_help = true)]
struct Cli {
    #[command(flatten)]
    global: Global,
    #[command(subcommand)]
    verb: Verb,
}

#[derive(Debug, Subcommand)]
enum Verb {
    /// Simulate, calibrate, score and report on the built-in scene
    Demo(demo::Arguments),
    /// Write a commented scene to start from
    New(new::Arguments),
    /// Read a scene and report everything that is wrong with it
    Check(check::Arguments),
    /// Simulate an experiment and write what it would have recorded
    Simulate(simulate::Arguments),
    /// Trace arbitrary rays through a scene's mirrors
    Trace(trace::Arguments),
    /// Measure the range errors of the bare sensor: Tables 1 to 4, Eqs. (3)–(5)
    Characterize(characterize::Arguments),
    /// Estimate where every mirrored beam goes
    Calibrate(calibrate::Arguments),
    /// Check that a calibration is well formed and physically plausible
    Validate(validate::Arguments),
    /// Compare a calibration with the truth or, without one, with boards and walls
    Score(score::Arguments),
    /// Compare several calibrations of one dataset, ours or third-party
    Compare(compare::Arguments),
    /// Run many experiments and report the statistics of their errors
    Study(Box<study::Arguments>),
    /// Plan which board poses to record next, and what each one gains
    Plan(plan::Arguments),
    /// Analyze the coverage, losses and attainable accuracy of mirror layouts
    Layout(layout::Arguments),
    /// Search a scene's parameters for better layouts
    Optimize(optimize::Arguments),
    /// Analyze the effect of manufacturing errors on a layout, before and after calibration
    Tolerance(tolerance::Arguments),
    /// Write a layout as solids, a 3D scene, a drawing table or frames
    Export(export::Arguments),
    /// Turn a scan into a point cloud
    Apply(apply::Arguments),
    /// Write an HTML page about calibrations and their scores
    Report(report::Arguments),
    /// Print the JSON Schema of scenes, or of another file, with the limits of its numbers
    Schema(schema::Arguments),
    /// Print the completion script of a shell
    Completions(completions::Arguments),
    /// Print the manual page, or write all of them
    Man(man::Arguments),
}

/// Runs the program on its arguments, the first of which is its name, and returns its exit code.
///
/// Results go to standard output, everything else to standard error. Ctrl-C, SIGTERM and SIGHUP stop the current run.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString>>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().map(Into::into).collect();
    let cli = match Cli::try_parse_from(&arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // If the help goes to a closed pipe, there is nothing left to do.
            let _ = error.print();
            return u8::try_from(error.exit_code()).unwrap_or(1);
        }
    };
    let context = Context {
        stop: interrupt::listen(),
        reporter: Arc::new(Reporter::new(cli.global.quiet)),
        given: arguments.into_iter().skip(1).collect(),
        global: cli.global,
    };
    let work = || {
        let ended = dispatch(&cli.verb, &context);
        context.reporter.finish();
        ended
    };
    let ended = match &cli.verb {
        // These print what is known already.
        Verb::New(_) | Verb::Schema(_) | Verb::Completions(_) | Verb::Man(_) => work(),
        _ => on_threads(context.global.threads, work),
    };
    match ended {
        Ok(()) => 0,
        // Whatever fails after that was stopped.
        Err(error) => context.check().err().unwrap_or(error).report(),
    }
}

/// Runs some work on a pool of the given number of threads, all of the machine's by default. A pool that is made only when it
/// is needed ends the program if the system has no threads left.
fn on_threads(
    threads: Option<u16>,
    work: impl FnOnce() -> Result<(), CliError> + Send,
) -> Result<(), CliError> {
    // Zero stands for the number of the machine's.
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads.unwrap_or(0).into())
        .build()
        .map_err(|e| catoptric::Error::Threads(e.to_string()))?
        .install(work)
}

fn dispatch(verb: &Verb, context: &Context) -> Result<(), CliError> {
    match verb {
        Verb::Demo(arguments) => demo::run(arguments, context),
        Verb::Simulate(arguments) => simulate::run(arguments, context),
        Verb::Trace(arguments) => trace::run(arguments, context),
        Verb::Characterize(arguments) => characterize::run(arguments, context),
        Verb::Calibrate(arguments) => calibrate::run(arguments, context),
        Verb::Validate(arguments) => validate::run(arguments),
        Verb::Score(arguments) => score::run(arguments, context),
        Verb::Compare(arguments) => compare::run(arguments, context),
        Verb::Study(arguments) => study::run(arguments, context),
        Verb::Plan(arguments) => plan::run(arguments, context),
        Verb::Layout(arguments) => layout::run(arguments, context),
        Verb::Optimize(arguments) => optimize::run(arguments, context),
        Verb::Tolerance(arguments) => tolerance::run(arguments, context),
        Verb::Export(arguments) => export::run(arguments, context),
        Verb::Apply(arguments) => apply::run(arguments, context),
        Verb::Report(arguments) => report::run(arguments, context),
        Verb::New(arguments) => new::run(arguments),
        Verb::Check(arguments) => check::run(arguments, context),
        Verb::Schema(arguments) => schema::run(arguments),
        Verb::Completions(arguments) => completions::run(arguments, Cli::command()),
        Verb::Man(arguments) => man::run(arguments, Cli::command()),
    }
}
