//! A cause in words.

use super::case::Case;
use super::kind::{AngleUnit, CauseKind, LengthUnit, RowsOf};
use crate::model::{End, PairingId};
use crate::units::{ScreenUnit, fixed, mm_from_m};

/// A clause that names the rows and what is wrong with them.
pub(super) fn sentence(case: &Case<'_>, rows: &[usize], kind: &CauseKind) -> String {
    let extent = Extent::new(case, rows, kind).to_string();
    let is_one = rows.len() == 1 && !extent.starts_with("all");
    let (fit, length, is) = if is_one { ("fits", "the length", "is") } else { ("fit", "the lengths", "are") };
    let name = |end: End, which: usize| match end {
        End::Chuck => &case.rig.chucks[which].name,
        End::Sphere => &case.rig.spheres[which].name,
    };
    let repeated = |singular: &'static str, plural: &'static str| if is_one { singular } else { plural };
    match *kind {
        CauseKind::EndsExchanged { end, between: [a, b] } => {
            format!("{end}s {} and {} look exchanged in {extent}", name(end, a), name(end, b))
        }
        CauseKind::OtherEnd { end, named, really } => {
            format!("{extent} {fit} with {end} {} instead of {}", name(end, really), name(end, named))
        }
        CauseKind::OtherPairing { named, really } => {
            let pairing = |id| case.rig.pairing_name(id);
            format!("{extent} {fit} with {} instead of {}", pairing(really), pairing(named))
        }
        CauseKind::OtherPairings { ref really } => {
            const SHOWN: usize = 3;
            let pose = |row: usize| &case.dataset.rows[row];
            let pairing = |id| case.rig.pairing_name(id);
            let told = |(&row, &really): (&usize, &PairingId)| {
                format!("row {} with {} instead of {}", pose(row).number, pairing(really), pairing(pose(row).pairing))
            };
            let some: Vec<String> = rows.iter().zip(really).take(SHOWN).map(told).collect();
            format!("{extent} each fit with another pairing: {} and so on", some.join(", "))
        }
        CauseKind::LengthUnit(LengthUnit::TenthOfMillimetre) => {
            format!("{length} of {extent} {is} ten times too large: is the decimal point a place too far right?")
        }
        CauseKind::LengthUnit(unit) => {
            let look = repeated("looks", "look");
            format!("{length} of {extent} {look} like {} where millimetres are expected", unit.plural())
        }
        CauseKind::RodMissing { rod_m } => {
            let lacks = repeated("lacks", "lack");
            format!("{length} of {extent} {lacks} the bar's nominal length of {} mm", mm(rod_m, 3))
        }
        CauseKind::OtherRod { longer_by_m } => {
            let side = if longer_by_m > 0.0 { "long" } else { "short" };
            format!("{length} of {extent} {is} {} mm too {side}: was another rod on the bar?", mm(longer_by_m.abs(), 3))
        }
        CauseKind::NoLength => format!("{length} of {extent} {is} next to nothing: was the bar attached?"),
        CauseKind::LengthRepeated => {
            format!("{length} of {extent} {} that of the row before: did the reading freeze?", repeated("repeats", "repeat"))
        }
        CauseKind::LengthShifted { by } => {
            let which = if by > 0 { "next" } else { "previous" };
            let own = repeated("is", "are each");
            format!("{length} of {extent} {own} that of the {which} pose: did lengths and poses get one row apart?")
        }
        CauseKind::JointSign { joint } => {
            format!("joint {} looks as if it were counted with the wrong sign in {extent}", joint + 1)
        }
        CauseKind::JointsExchanged { between: [a, b] } => format!("joints {} and {} look exchanged in {extent}", a + 1, b + 1),
        CauseKind::AngleUnit(AngleUnit::Radian) => {
            format!("angles of joints look like radians where degrees are expected in {extent}")
        }
        CauseKind::AngleUnit(AngleUnit::Degree) => {
            format!("angles of joints look like degrees converted once more where degrees are expected in {extent}")
        }
        CauseKind::EncoderTurns { joint, turns, by } => {
            let turns = match turns.abs() {
                1 => "one turn".to_owned(),
                many => format!("{many} turns"),
            };
            format!("joint {} is off by {}, {turns} of its encoder, in {extent}", joint + 1, joint_value(case, joint, by))
        }
        CauseKind::JointOffset { joint, by } => {
            format!("joint {} is off by {} in {extent}", joint + 1, joint_value(case, joint, by))
        }
        CauseKind::LengthOffset { by_m, .. } => {
            let side = if by_m > 0.0 { "long" } else { "short" };
            format!("the lengths of {extent} are {} mm too {side}: was the bar zeroed anew?", mm(by_m.abs(), 3))
        }
        CauseKind::Displaced { end, which, by_m, .. } => {
            let far_m = by_m.iter().map(|x_m| x_m * x_m).sum::<f64>().sqrt();
            let [x, y, z] = by_m.map(|x_m| mm(x_m, 2));
            let name = name(end, which);
            let far = mm(far_m, 2);
            format!("the lengths of {extent} fit with {end} {name} displaced by {far} mm (x {x}, y {y}, z {z}): did it slip?")
        }
        CauseKind::Unknown => format!("no cause found for {extent}"),
    }
}

fn mm(m: f64, decimals: usize) -> String {
    let text = fixed(mm_from_m(m), decimals);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// `+7.200 deg`.
fn joint_value(case: &Case<'_>, joint: usize, by: f64) -> String {
    let unit = ScreenUnit::from(case.robot.chain.joint_kinds()[joint]);
    format!("{:+.3} {}", unit.from_si(by), unit.name())
}

/// Which rows, as shortly as it can be said.
enum Extent {
    All,
    Sets(Vec<String>),
    Of { of: String, extent: Box<Extent> },
    From(usize),
    Between(usize, usize),
    Each(Vec<usize>),
}

impl Extent {
    fn new(case: &Case<'_>, rows: &[usize], kind: &CauseKind) -> Self {
        let of = match kind {
            CauseKind::LengthOffset { of, .. } => of.clone(),
            CauseKind::Displaced { end, which, .. } => RowsOf::end(*end, *which),
            _ => RowsOf::All,
        };
        let span = match *kind {
            CauseKind::LengthOffset { first, last, .. } | CauseKind::Displaced { first, last, .. } => Some((first, last)),
            _ => None,
        };
        // In some spans, all rows are of one chuck, set or whatever it is: then they are that many without it.
        let is_all = |(first, last): (usize, usize)| (first..=last).all(|row| of.has(case.dataset, row));
        let of = if span.is_some_and(is_all) { RowsOf::All } else { of };
        let extent = Self::within(case, rows, kind, &of, span);
        let of = match of {
            RowsOf::All => return extent,
            RowsOf::Chuck(chuck) => format!("chuck {}", case.rig.chucks[chuck].name),
            RowsOf::Sphere(sphere) => format!("sphere {}", case.rig.spheres[sphere].name),
            RowsOf::Pairing(pairing) => case.rig.pairing_name(pairing),
            RowsOf::Set(set) => format!("set {set}"),
            RowsOf::File(file) => case.dataset.files[file].clone(),
        };
        Self::Of { of, extent: Box::new(extent) }
    }

    fn within(case: &Case<'_>, rows: &[usize], kind: &CauseKind, of: &RowsOf, span: Option<(usize, usize)>) -> Self {
        /// A few rows are better named each.
        const FEW: usize = 4;
        /// Among them may be some that are wrong in another way.
        const NEARLY_ALL: f64 = 0.9;
        let number = |row: usize| case.dataset.rows[row].number;
        let is_of = |row: &usize| of.has(case.dataset, *row);
        let numbers = || Self::Each(rows.iter().map(|&row| number(row)).collect());
        if let Some((first, last)) = span {
            let is_last = (last + 1..case.count()).all(|row| !is_of(&row));
            let is_first = (0..first).all(|row| !is_of(&row));
            return match (is_first, is_last) {
                (true, true) => Self::All,
                (false, true) => Self::From(number(first)),
                _ => Self::Between(number(first), number(last)),
            };
        }
        if rows.len() < FEW || matches!(kind, CauseKind::Unknown | CauseKind::OtherPairings { .. }) {
            return numbers();
        }
        // Rows that were kept may have been hit and fit both ways.
        let is_covered = |row: usize| {
            let may_be = || case.shows(kind, row) || fits_both_ways(case, kind, row);
            rows.binary_search(&row).is_ok() || (!case.is_left_out(row) && may_be())
        };
        let concerned: Vec<usize> = (0..case.count()).filter(|&row| is_of(&row) && concerns(case, kind, row)).collect();
        if concerned.iter().all(|&row| is_covered(row)) {
            return Self::All;
        }
        let sets: Vec<Option<&String>> = rows.iter().map(|&row| case.dataset.rows[row].set.as_ref()).collect();
        let in_sets = |row: &&usize| sets.contains(&case.dataset.rows[**row].set.as_ref());
        if sets.iter().all(Option::is_some) && concerned.iter().filter(in_sets).all(|&row| is_covered(row)) {
            let mut names: Vec<String> = sets.into_iter().flatten().cloned().collect();
            names.dedup();
            return Self::Sets(names);
        }
        let (Some(&first), Some(&last)) = (rows.first(), rows.last()) else { return numbers() };
        let between: Vec<usize> = concerned.into_iter().filter(|row| (first..=last).contains(row)).collect();
        let covered = between.iter().filter(|&&row| is_covered(row)).count();
        if covered as f64 >= NEARLY_ALL * between.len() as f64 {
            return Self::Between(number(first), number(last));
        }
        numbers()
    }
}

/// Whether a cause may be one of a row's.
fn concerns(case: &Case<'_>, kind: &CauseKind, row: usize) -> bool {
    match kind {
        CauseKind::NoLength | CauseKind::LengthRepeated => true,
        _ => case.residual_without(kind, row).is_some(),
    }
}

fn fits_both_ways(case: &Case<'_>, kind: &CauseKind, row: usize) -> bool {
    const NEAR: f64 = 4.0;
    let fits = |without_m: f64| without_m.abs() < NEAR * case.rows[row].deviation_m;
    case.residual_without(kind, row).is_some_and(fits)
}

impl std::fmt::Display for Extent {
    /// `rows 12, 40 and 3 more`, `rows 40 to 80`, `all rows of set 460`.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        /// So many are named.
        const SHOWN: usize = 5;
        match self {
            Self::All => f.write_str("all rows"),
            Self::Sets(names) if names.len() == 1 => write!(f, "all rows of set {}", names[0]),
            Self::Sets(names) => write!(f, "all rows of sets {}", listed(names)),
            Self::Of { of, extent } => match **extent {
                Self::All => write!(f, "all rows of {of}"),
                Self::From(first) => write!(f, "{of} from row {first} on"),
                Self::Between(first, last) => write!(f, "{of} from row {first} to {last}"),
                ref other => write!(f, "{other} of {of}"),
            },
            Self::From(first) => write!(f, "all rows from {first} on"),
            Self::Between(first, last) => write!(f, "rows {first} to {last}"),
            Self::Each(numbers) if numbers.len() == 1 => write!(f, "row {}", numbers[0]),
            Self::Each(numbers) if numbers.len() <= SHOWN => write!(f, "rows {}", listed(numbers)),
            Self::Each(numbers) => {
                let named: Vec<String> = numbers[..SHOWN - 1].iter().map(usize::to_string).collect();
                write!(f, "rows {} and {} more", named.join(", "), numbers.len() - named.len())
            }
        }
    }
}

/// `a, b and c`.
fn listed<T: ToString>(items: &[T]) -> String {
    let items: Vec<String> = items.iter().map(T::to_string).collect();
    match items.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, others)) => format!("{} and {last}", others.join(", ")),
        None => String::new(),
    }
}
