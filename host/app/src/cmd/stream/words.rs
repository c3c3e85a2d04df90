//! What `stream` says while it runs.

use ballbar::JointKind;

use crate::board::RobotOnBoard;
use crate::record::{Account, Fate, Latest, News, Settled, SettledAt, stillness_name};
use crate::units::{ScreenUnit, fixed, joints_text, mm_from_m};

/// What happened.
pub(super) fn news_text(news: &News, port: &str, account: &Account) -> String {
    match news {
        News::Refused(sentence) => sentence.clone(),
        News::Settled(settled) => settled_text(settled, account),
        News::Away { reason } => format!("{port}: the board is away: {reason}; waiting for it"),
        News::Back { is_started_anew: false } => format!("{port}: the board is back"),
        News::Back { is_started_anew: true } => format!(
            "{port}: the board is back; it was started anew, so its encoders are NOT HOMED unless somebody has done so since"
        ),
    }
}

fn settled_text(Settled { number, pose, at }: &Settled, account: &Account) -> String {
    let Some((SettledAt { q, bar, newly_beyond }, robot)) = at.as_ref().zip(account.robot()) else {
        return format!("settled {number}: counts {:?}, code {:.1}", pose.counts_mean.as_slice(), pose.code_mean);
    };
    let joints = joints_text(robot.kinds(), q.as_array());
    let beyond: String =
        newly_beyond.iter().map(|beyond| format!("\nwarning: {beyond}: is the board homed where the robot stands?")).collect();
    let Some((displacement_m, fate)) = bar else {
        return format!("settled {number}: {joints}, and the bar beyond its travel: no pose{beyond}");
    };
    let displacement_mm = mm_from_m(*displacement_m);
    let length = match account.bar_mm() {
        Some(bar_mm) => format!("{:.4} mm", bar_mm + displacement_mm),
        None => format!("{displacement_mm:+.4} mm from mid travel"),
    };
    let fate = match fate {
        Fate::Written | Fate::Seen { is_homed: true } => "",
        Fate::Seen { is_homed: false } => "; NOT HOMED: host-cal home PORT --q …",
        Fate::Withheld => "; not written, because the encoders are NOT HOMED: host-cal home PORT --q …",
        Fate::SameStand => "; still where the last pose was written: not written again",
    };
    format!("settled {number}: {joints}, {length}, {} samples{fate}{beyond}", pose.samples)
}

/// How things stand, in a line.
pub(super) fn standing_text(account: &Account) -> String {
    let kinds = account.robot().map_or(&[][..], RobotOnBoard::kinds);
    let rate = account.rate_hz().map_or(String::new(), |hz| format!("{hz:.0} Hz  "));
    let (settled, lost) = (account.counts().settled, account.losses().lost());
    format!("{rate}settled {settled}  lost {lost}  {}", latest_text(account.latest(), kinds))
}

fn latest_text(latest: &Latest, kinds: &[JointKind]) -> String {
    let mut parts = Vec::new();
    match &latest.q {
        Some(q) => {
            let si: Vec<f64> = kinds.iter().zip(q).map(|(&kind, &q)| ScreenUnit::from(kind).to_si(q)).collect();
            parts.push(joints_text(kinds, &si));
        }
        None if !latest.counts.is_empty() => parts.push(format!("counts {:?}", latest.counts)),
        None => {}
    }
    parts.push(match (latest.length_mm, latest.displacement_mm, latest.code) {
        (Some(length), ..) => format!("length {} mm", fixed(length, 3)),
        (None, Some(displacement), _) => format!("bar {displacement:+.3} mm"),
        (None, None, Some(code)) if latest.q.is_none() => format!("code {code}"),
        _ => "no bar within its travel".into(),
    });
    parts.extend(latest.travel_left_mm.map(|[inwards, outwards]| format!("{inwards:.1} | {outwards:.1} mm left")));
    parts.extend(latest.position_mm.map(|[x, y, z]| format!("tool {x:.3} {y:.3} {z:.3} mm")));
    parts.extend(latest.stillness.map(|stillness| stillness_name(stillness).to_owned()));
    parts.join("  ")
}
